"""What `pamrig identify` leaves in a model's file beside the parameters, so that the file alone is worth a day of
records.

The numbers of a response model (`rig.model.response`), what it misses of the records that it was fitted to, their
noise, and the range that they showed. Plain data, read and written with the model; `rig.identify.fingerprint` makes it.
"""

import hashlib
import json
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.model.parameters import Model

VERSION = 2
"""Of what is written; 1 has no corrections."""
READ = (1, 2)
"""Versions that can be used."""


class PressureSource(StrEnum):
    """Where the pressures of the records come from."""

    MEASURED = "measured"
    VIRTUAL = "virtual"
    """Not measured: set-points through the model's regulators, or through usual ones."""


@dataclass(frozen=True)
class Fingerprint:
    """The response of one rig on some records, and how closely it is known. Everything stands at its default in a newer
    version's."""

    version: int = VERSION
    checksum: str = ""
    """Over the numbers here and those of the model that they stand beside: neither was changed alone."""
    pressures: PressureSource = PressureSource.MEASURED
    records: int = 0
    seconds: float = 0.0
    """Of all records together."""
    grid_s: float = 0.01
    p0_mpa: float = 0.2
    regulators_s: tuple[tuple[float, float, float], ...] = ()
    """Dead time, fill and exhaust time constant of each valve."""
    corrections: tuple[tuple[float, ...], ...] = ()
    """Of each valve: what its monitor shows beside the regulator, see `rig.model.response.regulator_terms`; none where
    the pressures are virtual, and in version 1."""
    weights: tuple[float, ...] = ()
    """Of the bank, see `rig.model.response_kernels`."""
    viscous_s: float = 0.0
    inertia_s: float = 0.0
    slip: tuple[float, ...] = ()
    curve: tuple[float, ...] = ()
    """The joint's balance, see `rig.model.response.Balance`."""
    exponent: float = 1.0
    compliance: float = 1.0
    misfit_deg: float = 0.0
    """Rms that the response model leaves of the angles it was fitted to."""
    misfit_mpa: tuple[float, ...] = ()
    """The same of each regulator, offsets aside; none where the pressures are virtual."""
    left_out_deg: float | None = None
    left_out_mpa: tuple[float, ...] = ()
    """The same on each record by a fit to the others; only from three records on."""
    noise_deg: float = 0.0
    noise_mpa: tuple[float, ...] = ()
    """White noise of the sensor and of each monitor as they were recorded, one standard deviation."""
    drive_mpa: tuple[float, float] = (0.0, 0.0)
    mean_mpa: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest drive d and mean pressure that the records showed; outside of it nothing is known."""


def fingerprint_checksum(fingerprint: Fingerprint, model: "Model") -> str:
    """Over every number of the fingerprint and of the model it stands beside; opens with letters, since 3e47 would be
    read as a number."""
    stages = {
        slot: [stage.kind, {name: parameter.value for name, parameter in stage.parameters.items()}]
        for slot, stage in model.stages().items()
    }
    effects = [[added.effect, added.parameters] for added in model.effects]
    own = asdict(fingerprint) | {"checksum": ""}
    if fingerprint.version == 1:
        del own["corrections"]
    numbers = [own, model.sample_time_s, model.p0_mpa, model.muscle.input, stages, effects]
    text = json.dumps(_one_zero(numbers), sort_keys=True)
    return f"sha-{hashlib.sha256(text.encode()).hexdigest()[:12]}"


def _one_zero(value: object) -> object:
    """The same without negative zeros: one that stands at its default is not written, and comes back as 0.0."""
    if isinstance(value, float):
        return value + 0.0
    if isinstance(value, dict):
        return {key: _one_zero(item) for key, item in value.items()}
    return [_one_zero(item) for item in value] if isinstance(value, list | tuple) else value


def fingerprint_trouble(model: "Model") -> str | None:
    """Why the model's fingerprint cannot be used, in one line; None when it can be, or when there is none."""
    known = model.fingerprint
    if known is None:
        return None
    if known.version not in READ:
        return (
            f"the model's fingerprint is of version {known.version}, this pamrig reads versions up to {VERSION}: it "
            "is not used"
        )
    if known.checksum != fingerprint_checksum(known, model):
        return (
            "the model's parameters or its fingerprint were changed after the identification: the fingerprint "
            "is not used"
        )
    return None
