"""A physics rig behind the interface of a device: a unit of a plant family, which shares no law with the simulator.

For trying what was made on a model against a rig that the model was not made from: `pamrig run`, `identify`, `gap
diagnose` and `track` take it like any other. Time and set-points are those of `hil.modelled_rig`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from hil.modelled_rig import ModelledRig
from rig.fields import bounded
from rig.interfaces import NAN, DeviceContext, Measurement, Wiring
from rig.sample import P1_ABSENT, P2_ABSENT


@dataclass(frozen=True)
class PhysicsSettings(Wiring):
    """The physics rig's part of a rig's YAML."""

    family: str = "mckibben"
    unit: int = bounded(0, 2**31 - 1, default=1)
    """Which rig of the family."""
    day: int = bounded(0, 2**31 - 1, default=1)
    """Which day on it: units drift from day to day."""
    drift: float = bounded(0.0, 0.1, "1", default=0.004)
    """How far (relative standard deviation)."""
    effects: dict[str, float] = field(default_factory=dict)
    """What is wrong with it: effects of the family by name, with their sizes."""
    detail_seed: int = bounded(0, 2**31 - 1, default=0)
    """Draws what is no size: which valve, which phase."""
    seed: int = bounded(0, 2**31 - 1, default=1)
    """Of the instruments' noise."""


class PhysicsRig(ModelledRig[PhysicsSettings]):
    """A whole rig in physics: both valves, both monitors and the angle."""

    Settings = PhysicsSettings
    device = "physics rig"

    def __init__(self, settings: PhysicsSettings, context: DeviceContext) -> None:
        from hil.reference import families

        wrong = families.disturbance(settings.family, settings.effects, settings.detail_seed)
        day = settings.day, settings.drift
        plant = families.stepped(settings.family, settings.unit, context.period_ns * 1e-9, day, wrong, settings.seed)
        super().__init__(settings, context, context.period_ns, plant.step)

    def facts(self) -> Mapping[str, str]:
        """Which unit it is."""
        named = self._settings
        return {"device": self.device, "unit": f"{named.family} {named.unit}", "seed": str(named.seed)}

    def read(self) -> Measurement:
        """Advance the plant to now; its instruments' newest readings."""
        p1_mpa, p2_mpa, angle_deg = self._now()
        p1_mpa, p2_mpa = NAN if self._missing & P1_ABSENT else p1_mpa, NAN if self._missing & P2_ABSENT else p2_mpa
        return Measurement(p1_mpa, p2_mpa, angle_deg, p1_mpa, p2_mpa, angle_deg, flags=self._missing)
