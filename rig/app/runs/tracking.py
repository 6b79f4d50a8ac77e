"""What `pamrig track` and `pamrig tune` do: feed-forward and gains from models, the runs, how well they followed."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from rig.app import shipped
from rig.app.runs import runner
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.sweeping import read_from
from rig.errors import ConfigError, RigError
from rig.excite.envelope import check_run
from rig.excite.run_plan import RunPlan, expand
from rig.excite.sweep import Sweep, load_sweep
from rig.gains import ClosedLoop
from rig.outputs import OutputKind, write_text
from rig.rig_config import RigConfig
from rig.service.session.run_setup import program_of

if TYPE_CHECKING:
    from rig.control.feedforward import FeedForward
    from rig.control.score import TrackingScore
    from rig.control.tuning import Tuned
    from rig.model.parameters import Model
    from rig.record import Record


class FeedForwardKind(StrEnum):
    """Where the feed-forward comes from."""

    NONE = "none"
    MODEL = "model"
    AUGMENTED = "augmented"


@dataclass(frozen=True)
class TrackOptions:
    """What was asked for."""

    reference: Path
    model: Path | None = None
    augmented: Path | None = None
    """Model for the augmented feed-forward; None: `model`, which must hold effects then."""
    kinds: tuple[FeedForwardKind, ...] = (FeedForwardKind.NONE,)


@dataclass(frozen=True)
class Tracked:
    """One run that was followed, and what was expected of it."""

    file: Path
    reference: str
    feedforward: FeedForwardKind
    score: "TrackingScore"
    expected: "FeedForward | None"
    run: Mapping[str, Any]
    """Its line in the outcome."""

    def to_json(self) -> dict[str, Any]:
        """One entry of `runs`."""
        plain = {"reference": self.reference, "feedforward": self.feedforward.value, **asdict(self.score)}
        if self.expected is not None:
            plain |= {
                "inverse_residual_rms_deg": self.expected.residual_rms_deg,
                "inverse_residual_max_deg": self.expected.residual_max_deg,
                "inverse_iterations": self.expected.iterations,
            }
        return dict(self.run) | plain


@dataclass(frozen=True)
class _Planned:
    kind: FeedForwardKind
    plan: RunPlan
    expected: "FeedForward | None"

    @property
    def name(self) -> str:
        return f"{self.plan.name}_{self.kind.value}"


@dataclass(frozen=True)
class PreparedTracking:
    """Everything before anything moves."""

    rig: RigConfig
    runs: tuple[_Planned, ...]
    gains: ClosedLoop
    tuned: "Tuned | None"
    """Where the gains come from the model, because the reference names none."""
    name: str
    attachments: Mapping[str, bytes]


def prepare(options: TrackOptions, rig: RigConfig) -> PreparedTracking:
    """References, gains and feed-forwards; RigError, one line, when something does not fit or cannot be followed."""
    path = shipped.find_config(options.reference, "references")
    sweep = _followed(path)
    models = _models(options)
    tuned = None
    if sweep.closed_loop is None:
        tuned = tune_for(_any_model(models, path), used_rests(sweep), rig.period_ns)
        sweep = replace(sweep, closed_loop=tuned.gains)
    assert sweep.closed_loop is not None
    plans = expand(sweep, rig.period_ns)
    for plan in plans:
        check_run(plan, rig.limits, rig.period_ns)
    runs = tuple(_with_feedforward(plans, models, options.kinds, rig))
    for one in runs:
        check_run(one.plan, rig.limits, rig.period_ns)
    return PreparedTracking(rig, runs, sweep.closed_loop, tuned, sweep.name, _attachments(path, options))


def follow(prepared: PreparedTracking, options: runner.RunOptions) -> tuple[RunOutcome, list[Tracked]]:
    """Carry the runs out and judge those that came to their end."""
    gains = {"closed_loop": asdict(prepared.gains)}
    runs = [
        runner.Planned(
            one.name, program_of(one.plan, number), {**one.plan.facts, **gains, "feedforward": one.kind.value}
        )
        for number, one in enumerate(prepared.runs, 1)
    ]
    attached = replace(options, attachments={**options.attachments, **prepared.attachments})
    outcome = runner.carry_out(prepared.rig, runs, attached)
    return outcome, list(_judged(prepared, outcome))


def used_rests(sweep: Sweep) -> tuple[float, ...]:
    """The rest pressures (MPa) that its records are made at, each once."""
    return tuple(dict.fromkeys(p0 for entry in sweep.entries for p0 in entry.p0_mpa or sweep.p0_mpa))


def rests_of(reference: Path) -> tuple[float, ...]:
    """The same of the reference at that place; ConfigError when it is none."""
    return used_rests(_followed(reference))


def tune_for(model: "Model", rests_mpa: Sequence[float], period_ns: int, **margins: float | None) -> "Tuned":
    """PI gains from a model, with its added effects, for a loop of that period that keeps its margins at each of these
    rest pressures: a joint at low pressure turns further; `margins` as of `tuning.tune`."""
    from rig.control import tuning
    from rig.control.plant import plant_of

    plants = [one for p0_mpa in rests_mpa for one in tuning.responses(plant_of(model, p0_mpa, period_ns))]
    return tuning.tune(plants, **{name: value for name, value in margins.items() if value is not None})


def _models(options: TrackOptions) -> "dict[FeedForwardKind, Model]":
    """The model of each feed-forward that there can be; ConfigError when one that is wanted lacks what it takes."""
    from rig.model.parameters import load_model

    found: dict[FeedForwardKind, Model] = {}
    if options.model is not None:
        model = load_model(shipped.find_config(options.model, "models"))
        found[FeedForwardKind.MODEL] = replace(model, effects=[])
        if model.effects:
            found[FeedForwardKind.AUGMENTED] = model
    if options.augmented is not None:
        found[FeedForwardKind.AUGMENTED] = load_model(shipped.find_config(options.augmented, "models"))
    if missing := next(
        (kind for kind in options.kinds if kind is not FeedForwardKind.NONE and kind not in found), None
    ):
        lacks = (
            "needs --model"
            if options.model is None
            else f"needs a model with added effects; {options.model} has none (see `pamrig gap diagnose "
            "--augmented-model`)"
        )
        raise ConfigError(f"--feedforward {missing.value}: {lacks}")
    return found


def _any_model(models: "Mapping[FeedForwardKind, Model]", path: Path) -> "Model":
    """The one that is most like the rig."""
    best = models.get(FeedForwardKind.AUGMENTED) or models.get(FeedForwardKind.MODEL)
    if best is None:
        raise ConfigError(f"{path}: closed_loop: gains are missing; give them, or --model to have them tuned")
    return best


def _with_feedforward(
    plans: Sequence[RunPlan],
    models: "Mapping[FeedForwardKind, Model]",
    kinds: Sequence[FeedForwardKind],
    rig: RigConfig,
) -> Iterator[_Planned]:
    from rig.control.feedforward import Inverter, envelope_box
    from rig.control.plant import plant_of

    inverters: dict[tuple[FeedForwardKind, float], Inverter] = {}
    for kind in kinds:
        for plan in plans:
            if kind is FeedForwardKind.NONE:
                yield _Planned(kind, plan, None)
                continue
            at = kind, plan.p0_mpa
            if at not in inverters:
                box = envelope_box(rig.limits, plan.p0_mpa, rig.period_ns)
                inverters[at] = Inverter(plant_of(models[kind], plan.p0_mpa, rig.period_ns), box)
            made = inverters[at].feedforward(plan)
            yield _Planned(kind, made.plan, made)


def _attachments(path: Path, options: TrackOptions) -> dict[str, bytes]:
    models = {f"{name}.yaml": place for name, place in (("model", options.model), ("augmented", options.augmented))}
    read = {name: shipped.find_config(place, "models").read_bytes() for name, place in models.items() if place}
    return {"reference.yaml": path.read_bytes(), **read}


def _judged(prepared: PreparedTracking, outcome: RunOutcome) -> Iterator[Tracked]:
    by_name = {one.name: one for one in prepared.runs}
    lines = {str(run["file"]): run for run in outcome.to_json()["runs"]}
    for result in outcome.runs:
        one = by_name.get(result.file.stem)
        if one is not None and result.complete and not result.fault and not result.error:  # what has no file is told
            yield Tracked(
                result.file, one.plan.name, one.kind, score_of(result.file), one.expected, lines[str(result.file)]
            )


def score_of(file: Path) -> "TrackingScore":
    """How well the sweep in a record followed the reference that it holds."""
    from rig.control.score import score

    record = followed_record(file)
    assert record.angle_deg is not None
    return score(record.angle_deg, record.extra["reference_deg"], record.dp_cmd_mpa, record.period_s)


def followed_record(file: Path) -> "Record":
    """The sweep of a closed-loop record; RigError when the file holds none."""
    from rig.log.reader import read

    record = read(file)[0]
    if "reference_deg" not in record.extra or record.angle_deg is None:
        raise RigError(f"{file}: holds no reference that an angle followed; see `pamrig track`")
    return record


def _followed(reference: Path) -> Sweep:
    """The sweep at that place, whose records are angles to follow; ConfigError when they are none."""
    sweep = load_sweep(reference)
    if not sweep.tracks:
        raise ConfigError(f"{reference}: records: expected angles to follow, for example `- sine: {{frequency_hz: 0.5, "
                          "amplitude_deg: 20}`; what it has are pressures, see `pamrig run`")  # fmt: skip
    return sweep


def write_gains(reference: Path, gains: ClosedLoop, output: Path) -> None:
    """The reference's YAML with these gains in place of its own, its limits kept, and its tables found from where
    `output` lies; ConfigError when it is none."""
    _followed(reference)
    raw = read_from(reference, output.parent)
    own = raw.get("closed_loop")
    found = {name: getattr(gains, name) for name in ("kp_mpa_per_deg", "ki_mpa_per_deg_s", "kd_mpa_s_per_deg")}
    raw["closed_loop"] = (own if isinstance(own, dict) else {}) | found
    write_text(output, yaml.safe_dump(raw, sort_keys=False), OutputKind.SWEEP)
