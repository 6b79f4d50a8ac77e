"""The chain of stages of a model: laid out in order, and run tick by tick in pure Python.

This is the simulator as the simulated rig drives it, without numpy, on the controller. `rig.model.simulation` runs the
same stages, compiled, over whole records.
"""

from collections.abc import Mapping, Sequence

from rig.config import suggest
from rig.errors import ModelError
from rig.model.effect_stages import EFFECT_STAGES, FORMER_NAMES, EffectStage, goes_on
from rig.model.effect_stages.timing import MOST_TICKS
from rig.model.equations import stages
from rig.model.external.simulator import KIND as EXTERNAL
from rig.model.external.simulator import External
from rig.model.parameters import (
    KINDS,
    AddedEffect,
    Model,
    MuscleModel,
    StageKind,
    StageModel,
    regulator_times_s,
)
from rig.model.slots import Placed, Slot, StageFunction

NOMINAL: dict[str, tuple[StageFunction, int]] = {
    StageKind.REGULATORS: (stages.regulators, 3),
    StageKind.MBW: (stages.modified_bouc_wen, 3),
    StageKind.BW: (stages.modified_bouc_wen, 3),
    StageKind.BW_CONTINUOUS: (stages.bouc_wen, 3),
    StageKind.SECOND_ORDER: (stages.second_order_joint, 3),
    StageKind.AFFINE: (stages.affine_sensor, 0),
}
"""Kind of a nominal stage -> its function and the length of its state; the kinds direct, rigid and ideal do nothing."""


def lay_out(model: Model) -> list[Placed]:
    """The stages of `model` in the order in which they run; ModelError for an effect that is not known, or makes
    commands later than a stage can hold."""
    nominal = model.stages()
    defaults = _of_the_rig(model)
    added = [place_effect(effect, defaults) for effect in model.effects]
    check_lateness(added, model.sample_time_s)
    chain: list[Placed] = []
    for slot in Slot:
        chain += [placed for placed in added if placed.slot is slot and EFFECT_STAGES[placed.name].before]
        if slot is Slot.MUSCLE and model.muscle.kind == EXTERNAL:
            chain.append(place_external(model.muscle))
        elif slot in nominal and nominal[slot].kind in NOMINAL:
            chain.append(place_nominal(slot, nominal[slot], model.p0_mpa))
        chain += [placed for placed in added if placed.slot is slot and not EFFECT_STAGES[placed.name].before]
    return chain


def check_lateness(placed: Sequence[Placed], dt_s: float, rows: int = 0, begun_s: float = 0.0) -> None:
    """ModelError where stages of that sample time make a command later than one of them can hold, at once or within so
    many rows of a record that began `begun_s` after its session."""
    for each in placed:
        at_once, with_time = EFFECT_STAGES[each.name].late if each.name in EFFECT_STAGES else (0.0, 0.0)
        counted = rows + begun_s / dt_s * each.whole_session
        ticks = each.params[0] * (at_once / dt_s + with_time * counted) if at_once or with_time else 0.0
        if ticks > MOST_TICKS:
            raise ModelError(
                f"effect {each.name}: it makes commands {ticks * dt_s:.4g} s late, {ticks:.0f} samples of "
                f"{dt_s * 1e3:g} ms; allowed: {MOST_TICKS}"
            )


def place_nominal(slot: Slot, stage: StageModel, p0_mpa: float) -> Placed:
    """The nominal stage of a slot with its numbers as its function reads them."""
    function, n_state = NOMINAL[stage.kind]
    params = [stage.value(name) for name in KINDS[slot][stage.kind]]
    if stage.kind == StageKind.BW:  # the modified model without its second terms
        lambda1, lambda2, xi, psi, beta, *units = params
        params = [lambda1, lambda2, xi, 0.0, psi, 0.0, beta, 0.0, *units]
    if function is stages.modified_bouc_wen:
        params.append(p0_mpa)
    return Placed(stage.kind, slot, function, tuple(params), n_state)


def _of_the_rig(model: Model) -> dict[str, float]:
    """What an effect acts on, by the names of its numbers: the mean pressure, and the regulators' time constant if it
    has any."""
    if model.valve.kind != StageKind.REGULATORS:
        return {"p0_mpa": model.p0_mpa}
    return {
        "p0_mpa": model.p0_mpa,
        "tau0_s": sum(map(sum, regulator_times_s(model.valve))) / 4.0,
    }


def place_external(muscle: MuscleModel) -> Placed:
    """A simulator that is not ours, in the place of the muscles."""
    return Placed(EXTERNAL, Slot.MUSCLE, External(muscle.source, muscle.names, muscle.patience_s), (), 1)


def stage_of(added: AddedEffect) -> EffectStage:
    """How an added effect enters the chain; ModelError for one that nobody knows."""
    if added.effect not in EFFECT_STAGES:
        raise ModelError(f"unknown effect {added.effect!r}; {suggest(added.effect, list(EFFECT_STAGES))}")
    return EFFECT_STAGES[added.effect]


def place_effect(added: AddedEffect, defaults: Mapping[str, float]) -> Placed:
    """An added effect with its numbers in order; what is left out is the rig's own (`defaults`) or stands at its
    neutral value, but for the size.

    ModelError when the effect or a parameter is unknown, missing or out of its bounds.
    """
    known, where = stage_of(added), f"effect {added.effect}"
    names = list(known.parameters)
    given = {FORMER_NAMES.get(name, name): value for name, value in added.parameters.items()}
    for name in given:
        if name not in names:
            raise ModelError(f"{where}: unknown parameter {name!r}; {suggest(name, names)}")
    if known.size not in given:
        raise ModelError(f"{where}: the parameter {known.size!r} is missing")
    params = known.neutral()
    params |= {name: value for name, value in defaults.items() if name in names} | given
    for allowed in known.numbers:
        if not allowed.low <= params[allowed.name] <= allowed.high:
            raise ModelError(
                f"{where}: {allowed.name} {params[allowed.name]:g} is outside {allowed.low:g} .. {allowed.high:g} "
                f"{allowed.unit}"
            )
    numbers = tuple(params[name] for name in names)
    return Placed(added.effect, known.slot, known.stage, numbers, known.state_size, goes_on(params))


class Chain:
    """The simulator of one rig, advanced one sample time at a call."""

    def __init__(self, model: Model) -> None:
        if model.muscle.kind == EXTERNAL:
            raise ModelError(
                f"{model.muscle.source}: it answers whole records, and the simulated rig goes tick by tick; "
                "allowed there: a model of pamrig's own"
            )
        self._dt_s = model.sample_time_s
        self._upstream: list[Placed] = []
        self._downstream: list[Placed] = []
        for placed in lay_out(model):
            (self._upstream if placed.slot in (Slot.TIMING, Slot.VALVE) else self._downstream).append(placed)
        self.reset()

    def reset(self, p1_mpa: float | None = None, p2_mpa: float | None = None) -> None:
        """Back to the start: angle 0, regulators settled at these set-points, or at the first ones that `step` gets."""
        self._ahead = [(placed.stage, [0.0] * placed.n_state, placed.params) for placed in self._upstream]
        self._behind = [(placed.stage, [0.0] * placed.n_state, placed.params) for placed in self._downstream]
        if p1_mpa is not None and p2_mpa is not None:
            self.step(p1_mpa, p2_mpa)

    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        """One sample time later under these set-points, held meanwhile: what the monitors read (MPa) and the angle
        (deg)."""
        dt_s = self._dt_s
        p1, p2, y = [p1_cmd_mpa], [p2_cmd_mpa], [0.0]
        for stage, state, params in self._ahead:
            stage(p1, p2, y, state, params, dt_s)
        p1_mpa, p2_mpa = p1[0], p2[0]
        for stage, state, params in self._behind:
            stage(p1, p2, y, state, params, dt_s)
        return p1_mpa, p2_mpa, y[0]
