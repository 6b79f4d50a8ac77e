"""The plant families: rigs of different build, so that what is fitted on one can be judged on another.

    rig = unit("fluidic", seed=7)                 # one rig; the same family and seed give the same rig
    other = unit("fluidic", seed=8)               # a sister: another rig of the same build
    monday = rig.session(seed=1, drift=0.008)     # a day on it
    record = run(excitation, rig, monday)         # healthy
    wrong = disturbance("fluidic", {"valve_lag": 0.02, "backlash": 0.5})
    record = run(excitation, rig, monday, wrong)  # with two effects

Families share the excitations, the drawing of cases and the names of effects; no law and no parameter.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Protocol

import numpy as np

from hil.reference.compiling import Array
from hil.reference.disturbance import Disturbance, merged
from hil.reference.effect_law import EffectLaw
from hil.reference.excitations import Excitation
from hil.reference.names import NAMES, STEPPED
from hil.reference.plant import Build, PlantDay, make_plant
from rig.errors import RigError

Columns = dict[str, Array]
Named = dict[str, Columns]
"""Record name -> its columns."""


class Stepped(Protocol):
    """A rig that moves on by one period at a call: for whoever decides by its readings."""

    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        """p1, p2 (MPa) and angle (deg) as read one period later, under these set-points meanwhile. RigError when the
        joint runs away."""


class Unit(Protocol):
    """One rig of a family."""

    def session(self, seed: int, drift: float = 0.004) -> PlantDay:
        """A day; `drift` is the relative standard deviation of what drifts, 0.004 to 0.02."""

    def still(self) -> PlantDay:
        """A day without any drift, as the unit was built."""

    def simulate(
        self,
        p1_cmd_mpa: Array,
        p2_cmd_mpa: Array,
        period_s: float,
        session: PlantDay,
        disturbance: Disturbance | None = None,
        noise_seed: int = 0,
    ) -> Columns:
        """One record: columns t_s, p1_cmd_mpa, p2_cmd_mpa, dp_cmd_mpa, p1_mpa, p2_mpa, angle_deg, each of shape (n,),
        and angle_zero_deg where the record took its own zero.

        Set-points are gauge MPa, one a period, held; reading k is taken as set-point k is sent. The same arguments give
        the same record. RigError when the joint runs away (a disturbance far outside its range).
        """


@dataclass(frozen=True)
class Family:
    """A build of rig: how its units are made, and what can be wrong with them."""

    build: Build
    effects: Mapping[str, EffectLaw]
    """Effects that a library may hold, by the names of the library."""
    foreign: Mapping[str, EffectLaw]
    """Effects that no library holds."""
    own_zero: bool = False
    """Each record of its units counts the angle from where the joint rested before it."""

    @property
    def name(self) -> str:
        """Of its build."""
        return self.build.name

    @property
    def healthy(self) -> Disturbance:
        """Nothing is wrong."""
        return self.build.healthy

    def make(self, seed: int) -> Unit:
        """The unit of that number."""
        return make_plant(self.build, seed, self.own_zero)

    @property
    def laws(self) -> dict[str, EffectLaw]:
        """Both kinds."""
        return {**self.effects, **self.foreign}


def family(name: str, own_zero: bool = False) -> Family:
    """The family of that name, its records counted from zeros of their own or not; RigError when there is none."""
    if name not in NAMES:
        raise RigError(f"plant family {name!r}: expected one of {', '.join(NAMES)}")
    build, laws = (import_module(f"hil.reference.{name}.{part}") for part in ("plant", "other_laws"))
    return Family(build.BUILD, laws.OTHER_LAWS, laws.FOREIGN, own_zero)


def unit(family_name: str, seed: int) -> Unit:
    """The rig of that number; units of one family are sisters, rigs of the same build that differ by 1 to 30 % in each
    parameter."""
    return family(family_name).make(seed)


def stepped(
    family_name: str, unit_seed: int, period_s: float, day: tuple[int, float], disturbance: Disturbance,
    noise_seed: int = 0
) -> Stepped:  # fmt: skip
    """A unit one period at a time, settled at 0.2 MPa; `day`: its seed and drift, see `Unit.session`.

    RigError for a family that cannot be stepped, and for a disturbance of instruments or timing that has a memory of
    its own: those are for whole records.
    """
    if family_name not in STEPPED:
        raise RigError(f"plant family {family_name!r}: tick by tick there is {', '.join(STEPPED)}")
    plant = make_plant(family(family_name).build, unit_seed)
    stepper = import_module(f"hil.reference.{family_name}.stepped")
    made: Stepped = stepper.Stepped(plant, plant.session(*day), disturbance, period_s, noise_seed)
    return made


def disturbance(family_name: str, sizes: Mapping[str, float], detail_seed: int = 0) -> Disturbance:
    """These effects (name -> signed size, see the family's table) at once. What is no size (which valve, which phase)
    comes from `detail_seed`. RigError for a name that the family does not have.
    """
    chosen = family(family_name)
    for effect in sizes:
        if effect not in chosen.laws:
            raise RigError(f"effect {effect!r}: family {family_name} has {', '.join(sorted(chosen.laws))}")
    parts = [
        chosen.laws[effect].law(size, np.random.default_rng((detail_seed, k)))
        for k, (effect, size) in enumerate(sizes.items())
    ]
    return merged(chosen.healthy, parts)


def run(
    excitation: Excitation, rig: Unit, session: PlantDay, disturbance: Disturbance | None = None, noise_seed: int = 0
) -> Columns:
    """The record of one excitation, see `Unit.simulate`; without a disturbance the rig is healthy."""
    half = 0.5 * excitation.dp_mpa()
    set_points = excitation.p0_mpa + half, excitation.p0_mpa - half
    return rig.simulate(*set_points, excitation.period_s, session, disturbance, noise_seed)
