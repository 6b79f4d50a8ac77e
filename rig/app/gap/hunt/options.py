"""What a hunt works with, and what of that it goes on with only."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path

from rig.app import shipped
from rig.app.gap.hunt.folder import MODEL_TEXT, RIG_TEXT
from rig.gap.reference.kinds import AUTO
from rig.record import Record
from rig.rig_config import RigConfig
from rig.service.client import Client


@dataclass(frozen=True)
class HuntOptions:
    """What a hunt works with."""

    rig: RigConfig
    model: Path
    folder: Path
    days: Sequence[Sequence[Record]] = ()
    day_names: tuple[str, ...] = ()
    every_day: bool = False
    """Days that no other day comes near count as well."""
    reference: str = AUTO
    minutes: float = 10.0
    first: Path = Path("gap")
    """The session that a hunt begins with."""
    virtual: bool = False
    seed: int | None = None
    force: bool = False
    daemon: Client | None = None
    """The daemon whose jobs the sweeps are to be; None: they run here."""

    @cached_property
    def asked(self) -> dict[str, object]:
        """What a hunt goes on with only, by the names of the options: as it was when it was first looked at."""
        return {
            "rig": self.rig.name,
            RIG_TEXT: _digest(self.rig),
            "model": str(self.model),
            MODEL_TEXT: sha256(shipped.find_config(self.model, "models").read_bytes()).hexdigest(),
            "reference": self.reference,
            "baselines": list(self.day_names),
            "every_day": self.every_day,
            "sweep": str(self.first),
        }


def _digest(rig: RigConfig) -> str:
    """Of what its records depend on: devices, roles, calibration, channels, period, and the files that these name. Its
    limits, its safe state and its tags may change while a hunt waits."""
    devices = [(each.name, each.kind, each.settings, sorted(each.roles)) for each in rig.devices]
    files = [sha256(text).hexdigest() for _, text in sorted(rig.used.items())]
    basis = [rig.period_ns, devices, rig.calibration, rig.channels.plain(), [str(one) for one in rig.further], files]
    return sha256(json.dumps(basis, sort_keys=True, default=str).encode("utf-8", "backslashreplace")).hexdigest()
