"""What `pamrig replay` does: a program from each recording, a session for it, the comparison into the log and a
figure."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.app import compose, shipped
from rig.app.runs import record_folders, runner
from rig.app.runs.outcome import RunOutcome
from rig.channels import PNEUMATIC, REST_MPA, Channels, channels_of, common
from rig.config import read_yaml, structure, suggest
from rig.errors import CheckFailed, ConfigError, RecordError, RigError
from rig.excite.envelope import check_setpoints
from rig.log import log_files, reader
from rig.log.convert import LogContent, content_of_record, read_content, write_content
from rig.log.foreign.kinds import FileKind, kind_of
from rig.log.replay import (
    PERIOD_TOLERANCE,
    ReplayComparison,
    compare,
    departures,
    onto_period,
    program_of,
    recorded_period_ns,
)
from rig.model.external.simulator import KIND as EXTERNAL
from rig.outputs import check_free, targets_in
from rig.own_units import own_plain
from rig.realtime.program import Program
from rig.report import log_figures
from rig.rig_config import PERIODS_MS, RigConfig
from rig.sample import WIRES, Phase

if TYPE_CHECKING:
    from rig.model.parameters import Model

_KEPT_FACTS = ("signal", "frequency_hz", "amplitude_mpa", "p0_mpa", "repeat", "sweep", "channels", "tags", "note")


@dataclass(frozen=True)
class Recording:
    """One log to be replayed."""

    name: str
    source: Path
    content: LogContent
    program: Program

    @property
    def channels(self) -> Channels:
        """What its rig's input and output are."""
        return channels_of(self.content.run_facts, str(self.source))


@dataclass(frozen=True)
class ReplayJob:
    """Recordings and the rig they go to."""

    rig: RigConfig
    recordings: list[Recording]
    device_options: Mapping[str, Any] = field(default_factory=dict)
    simulator: "Model | None" = None
    """One that is not ours and answers whole records, in place of the rig's own."""


@dataclass(frozen=True)
class ReplayOptions:
    """How it is to be done."""

    out: Path | None = None
    clock: str | None = None
    seed: int | None = None
    force: bool = False
    figure: Path | None = None
    tolerances: Mapping[str, float] | None = None


@dataclass(frozen=True)
class Replayed:
    """What came of one recording."""

    file: Path
    figure: Path
    comparison: Mapping[str, Any]
    departures: list[str]
    outcome: RunOutcome
    beside: ReplayComparison
    """The replay beside its recording, tick by tick."""
    channels: Channels = PNEUMATIC

    def to_json(self) -> dict[str, Any]:
        """The result as the commands' reference has it, in the rig's own units."""
        plain: dict[str, Any] = own_plain({**self.outcome.to_json()["runs"][0], **self.comparison}, self.channels)
        return plain | {"file": str(self.file), "figure": str(self.figure), "departures": self.departures}


def prepare(
    log: Path, rig: RigConfig | Path | None, model: Path | None, p0_mpa: float | None, resample: bool
) -> ReplayJob:
    """Read, turn into programs, and check against the rig's envelope: nothing has moved yet. Without a rig it is the
    simulated one, at the recordings' own period unless `resample`."""
    contents = list(_contents(log))
    rig = rig if isinstance(rig, RigConfig) else _loaded(rig, contents if rig is None and not resample else ())
    found = None if model is None else shipped.find_config(model, "models")
    simulator = None if found is None else _simulator(found, rig)
    recordings = [_recording(name, source, content, rig, p0_mpa, resample) for name, source, content in contents]
    if found is None or simulator is None:
        _check_rig(str(rig.path), rig.channels, recordings)
        return ReplayJob(rig, recordings)
    if simulator.muscle.kind == EXTERNAL:  # it answers whatever is asked of it
        return ReplayJob(rig, recordings, simulator=simulator)
    _check_rig(str(found), simulator.own_channels, recordings)
    return ReplayJob(rig, recordings, {"model": found.resolve()})


def _simulator(path: Path, rig: RigConfig) -> "Model":
    """The model in place of a simulated rig's own; whatever is wrong with it is said before a session starts."""
    if not compose.is_simulated(rig):
        raise RigError(f"{rig.path}: --model is for a simulated rig; this one is real")
    from rig.model.parameters import load_model

    return load_model(path)


def _loaded(path: Path | None, recordings: Sequence[tuple[str, Path, LogContent]]) -> RigConfig:
    """The rig at `path`, or the simulated one at the period that these recordings share."""
    rig = compose.load(path)
    periods = {recorded_period_ns(content.samples, str(source)) for _, source, content in recordings}
    (period_ns,) = periods if len(periods) == 1 else {rig.period_ns}
    same = abs(period_ns - rig.period_ns) <= PERIOD_TOLERANCE * rig.period_ns
    low_ms, high_ms = PERIODS_MS
    return rig if same or not low_ms <= period_ns * 1e-6 <= high_ms else replace(rig, period_ns=period_ns)


def load_gate(path: Path) -> dict[str, float]:
    """The tolerances at `path`: a YAML mapping of fields of a sample to the largest difference allowed, in the field's
    unit. ConfigError for a gate that would let everything through, or nothing."""
    raw = read_yaml(path)
    if not isinstance(raw, dict) or not all(isinstance(value, int | float) for value in raw.values()):
        raise ConfigError(f"{path}: a gate maps fields to tolerances, for example `angle_deg: 0.001`")
    gate = structure(raw, dict[str, float], str(path))
    if not gate:
        raise ConfigError(f"{path}: names no field: it would let everything through")
    for name, tolerance in gate.items():
        if name not in WIRES:
            raise ConfigError(f"{path}: unknown field {name!r}; {suggest(name, list(WIRES))}")
        if tolerance < 0.0:
            raise ConfigError(f"{path}: {name}: {tolerance:g} is below 0: no replay can keep it")
    return gate


def replay_all(job: ReplayJob, options: ReplayOptions) -> Iterator[Replayed]:
    """Each recording in a session of its own, so that what comes before it does not matter, and told as it is done; a
    rig that was stopped does not move again for the next one. CheckFailed, with what is known of the safe state, when
    nothing can be compared."""
    out = options.out or record_folders.new_folder("replay")
    single = log_files.is_mcap(out) and len(job.recordings) == 1
    targets = [out] if single else targets_in(out, (recording.name for recording in job.recordings), ".mcap")
    if len(targets) > 1 and options.figure is not None and options.figure.suffix:
        raise RecordError(f"--figure {options.figure}: {len(targets)} replays need a figure each; give a folder")
    check_free(targets)
    for recording, target in zip(job.recordings, targets, strict=True):
        done = _replay(job, recording, options, target)
        yield done
        if done.outcome.stopped:
            break


def _contents(log: Path) -> Iterator[tuple[str, Path, LogContent]]:
    for file in _complete_files(log) if log.is_dir() else [log]:
        if kind_of(file) is FileKind.MCAP:
            yield log_files.stem(file), file, read_content(file)
            continue
        for record in reader.read(file):
            yield log_files.stem(file), file, content_of_record(record, {})


def _complete_files(folder: Path) -> list[Path]:
    """The recordings of a folder that are complete; the others are named. RecordError when there is none."""
    files = sorted(file for file in log_files.below(folder) if log_files.is_mcap(file))
    if not files:
        raise RecordError(f"{folder}: no .mcap file in this folder")
    left_out = [file for file in files if not reader.is_complete(file)]
    if len(left_out) == len(files):
        raise RecordError(f"{folder}: no recording in it is complete; name one to replay it as it is")
    return [file for file in files if file not in left_out]


def _recording(
    name: str, source: Path, content: LogContent, rig: RigConfig, p0_mpa: float | None, resample: bool
) -> Recording:
    if p0_mpa is None and isinstance(content.run_facts.get("p0_mpa"), int | float):
        p0_mpa = float(content.run_facts["p0_mpa"])
    if p0_mpa is None and not channels_of(content.run_facts, str(source)).has_valves:
        p0_mpa = REST_MPA
    if resample:
        content = replace(content, samples=onto_period(content.samples, rig.period_ns))
    program = program_of(content.samples, rig.period_ns, p0_mpa, str(source))
    rest = program.rest_p1_mpa, program.rest_p2_mpa
    check_setpoints(name, _after_settling(program, rest), rest, rig.limits, rig.period_ns)
    return Recording(name, source, content, program)


def _after_settling(program: Program, rest: tuple[float, float]) -> Iterator[tuple[str, float, float]]:
    for index in range(program.settle_ticks, program.ticks):
        phase, p1_mpa, p2_mpa = program.at(index, rest)
        yield Phase(phase).name.lower().replace("_", " "), p1_mpa, p2_mpa


def _replay(job: ReplayJob, recording: Recording, options: ReplayOptions, target: Path) -> Replayed:
    """Carry it out into a file beside `target`, which stays if anything goes wrong, and add the comparison."""
    virtual = options.clock == "virtual" if options.clock else compose.is_simulated(job.rig)
    if virtual:
        compose.allow_virtual(job.rig)
    given = recording.content.run_facts
    seed = options.seed if options.seed is not None else given.get("seed")
    facts = {key: given[key] for key in _KEPT_FACTS if key in given}
    facts |= {"name": recording.name, "replay_of": recording.source.name, "replay_of_sha256": _sha256(recording.source)}
    with _rig_of(job, recording) as rig:
        outcome = runner.carry_out(
            rig,
            [runner.Planned(f"{target.stem}.uncompared", recording.program, facts)],
            runner.RunOptions(
                target.parent,
                virtual=virtual,
                seed=seed if isinstance(seed, int) else None,
                force=options.force,
                attachments={
                    name: data for name, data in recording.content.attachments.items() if name == "sweep.yaml"
                },
                device_options=job.device_options,
            ),
        )
    if not outcome.runs or outcome.recorder_lost or outcome.runs[0].error:  # what was left behind is not whole
        outcome.judge()
        raise CheckFailed(f"{recording.source}: the replay recorded nothing")
    try:
        return _compared(recording, outcome, target, options)
    except CheckFailed:
        raise
    except RigError as error:  # of a file: what became of the rig is told first
        outcome.judge(str(error))
        raise


def _check_rig(name: str, channels: Channels, recordings: list[Recording]) -> None:
    """RecordError when a recording is of another rig than the one that is to answer it."""
    common([(name, channels), *((str(one.source), one.channels) for one in recordings)])


def _rig_of(job: ReplayJob, recording: Recording) -> AbstractContextManager[RigConfig]:
    """The rig, or one that answers this recording as the simulator says."""
    if job.simulator is None:
        return nullcontext(job.rig)
    from rig.app.stand_ins.precomputed import precomputed

    return precomputed(job.rig, job.simulator, recording.program)


def _compared(recording: Recording, outcome: RunOutcome, target: Path, options: ReplayOptions) -> Replayed:
    """The comparison, written into the log that stays."""
    raw = outcome.runs[0].file
    made = read_content(raw)
    if not (made.samples["phase"] == Phase.SWEEP).any():
        outcome.judge()
        raise CheckFailed(f"{raw}: the replay ended before the sweep")
    comparison = compare(recording.content.samples, made.samples, str(recording.source))
    facts = comparison.facts()
    compared = replace(made, result_facts=dict(made.result_facts) | {"replay": facts}, comparison=comparison)
    try:
        write_content(compared, target)
    except RigError as error:
        raise RigError(f"{error}; the replay itself is whole and stays at {raw}") from None
    raw.unlink()
    outcome.runs[0].file = target
    figure = (
        options.figure
        if options.figure and options.figure.suffix
        else (options.figure or target.parent) / f"{target.stem}.svg"
    )
    log_figures.save(log_figures.replay_figure(recording.name, comparison, recording.channels), figure)
    moved = (
        departures(recording.content.samples, made.samples, options.tolerances)
        if options.tolerances is not None
        else []
    )
    return Replayed(target, figure, facts, moved, outcome, comparison, recording.channels)


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
