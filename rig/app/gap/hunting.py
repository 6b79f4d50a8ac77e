"""What `pamrig gap hunt` does: run a session, diagnose, run the records that part what is still possible, join the
evidence, until one name is left, nothing is found, nothing parts the rest, or the time is over."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from itertools import chain, count
from pathlib import Path

from rig.app import shipped
from rig.app.gap.daemon_jobs import at_hand, check_free, last_job, taken
from rig.app.gap.hunt_folder import FILE, MODEL_TEXT, Hunt, HuntStep, alone_in, open_hunt
from rig.app.gap.planning import resting
from rig.app.gap.sweep_envelope import envelope_of
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.sweeping import SweepOptions, run_sweep, text_from
from rig.app.terminal import progress
from rig.channels import Channels
from rig.errors import ConfigError, Interrupted, RigError
from rig.excite.envelope import check_run
from rig.excite.experiment import expand, load_sweep
from rig.gap.answer.result import Diagnosis
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.library import NONE, UNKNOWN
from rig.gap.pipeline import Grounds
from rig.gap.plan.candidates import lasting_s
from rig.gap.plan.experiment import Experiment
from rig.gap.plan.next_experiment import what_next
from rig.gap.reference.build import AUTO, Kind, because, choose
from rig.gap.settings import CREDIBLE
from rig.log.reader import read
from rig.model.parameters import Model, load_model
from rig.outputs import OutputKind as Output
from rig.outputs import write_text
from rig.record import Record
from rig.report.gap_page import write_page
from rig.report.hunt_page import ToldStep, write_hunt
from rig.rig_config import RigConfig
from rig.service.client import Client

NAMED, NOTHING, TIME = "named", "nothing parts the rest", "time"
NO_GAP, NO_NAME = "no cause found", "something unknown"
ROUNDING_MIN = 1e-6
"""Sums of minutes closer than this to what is allowed count as allowed."""


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
            "model": str(self.model),
            MODEL_TEXT: sha256(shipped.find_config(self.model, "models").read_bytes()).hexdigest(),
            "reference": self.reference,
            "baselines": list(self.day_names),
            "every_day": self.every_day,
            "sweep": str(self.first),
        }


@dataclass(frozen=True)
class HuntFinding:
    """What is known after a step."""

    diagnosis: Diagnosis
    grounds: Grounds

    @property
    def names(self) -> tuple[tuple[str, float], ...]:
        """What is still possible on the factors where something was found; none where nothing was."""
        found = [posterior for posterior in self.grounds.posteriors if posterior.found]
        if not found:
            return ((NONE, min(posterior.probability[NONE] for posterior in self.grounds.posteriors)),)
        return tuple((name, posterior.probability[name]) for posterior in found for name in posterior.names)

    @property
    def settled(self) -> str:
        """How it is known, in the words that a hunt ends with: one hypothesis holds the credible mass wherever
        something was found, or nothing was; else empty."""
        found = [posterior for posterior in self.grounds.posteriors if posterior.found]
        if any(max(posterior.probability.values()) < CREDIBLE for posterior in found):
            return ""
        if not found:
            return NO_GAP
        return NO_NAME if all(posterior.best == UNKNOWN for posterior in found) else NAMED


@dataclass(frozen=True)
class Hunted:
    """What came of it."""

    hunt: Hunt
    finding: HuntFinding | None
    cut_short_by: str = ""
    """The error or interruption that the hunt broke off by, which leaves it open to go on; empty where it came to an
    end of its own."""

    @property
    def ended(self) -> str:
        """How it ended, as its page and the JSON of the command say it."""
        return f"cut short: {self.cut_short_by}" if self.cut_short_by else self.hunt.ended

    def to_json(self) -> dict[str, object]:
        """The JSON of the command."""
        return {
            "steps": [step.to_json() for step in self.hunt.steps],
            "diagnosis": None if self.finding is None else self.finding.diagnosis.to_json(),
            "minutes": self.hunt.minutes,
            "ended": self.ended,
            "folder": str(self.hunt.folder),
        }


def hunt(
    options: HuntOptions,
    allowed: Callable[[HuntStep], bool] = lambda step: True,
    report: Callable[[HuntStep, HuntFinding], None] = lambda step, finding: None,
) -> Hunted:
    """Hunt until it is known; `allowed` is asked before anything moves, `report` hears of every step that is diagnosed
    through. What is known stays in the folder, also when the rig faults (CheckFailed) or somebody interrupts.
    EnvelopeError before anything is planned when the first session would leave the rig's limits, ConfigError when it
    takes longer than the hunt may."""
    model = load_model(shipped.find_config(options.model, "models"))
    choose(options.reference, model, len(options.days))
    so_far = open_hunt(options.folder, options.asked)
    finding: HuntFinding | None = None
    if not so_far.steps:
        so_far = _first(so_far, options)
    elif len(so_far.steps) > 1 and not so_far.steps[-1].done:
        finding = diagnose_so_far(options, model, so_far)
        report(so_far.steps[-2], finding)
    so_far = replace(so_far, ended="")
    while True:
        if not so_far.steps[-1].done:
            if why := _barred(options, so_far, allowed):
                return _ended(so_far, finding, why)
            so_far = _recorded(so_far, options)
        with progress(f"diagnosing after step {len(so_far.steps)}"):
            finding = diagnose_so_far(options, model, so_far)
        so_far = so_far.with_last(replace(so_far.steps[-1], set=finding.names))
        report(so_far.steps[-1], finding)  # before its file: it is said where that cannot be written
        so_far.save()
        if finding.settled:
            return _ended(so_far, finding, finding.settled)
        left_s = 60.0 * (options.minutes - so_far.minutes)
        with progress("planning what tells more"):
            planned = _next(options, finding, left_s)
            more = planned or _next(options, finding, 3600.0)
        if planned is None:
            return _ended(so_far, finding, NOTHING if more is None else TIME)
        so_far = _with_step(so_far, planned, options.rig.channels)


def diagnose_so_far(options: HuntOptions, model: Model, so_far: Hunt) -> HuntFinding:
    """The diagnosis of all records so far."""
    first, *later = [read(so_far.folder / step.records) for step in so_far.steps if step.done]
    kind = choose(options.reference, model, len(options.days))
    diagnosis, grounds = diagnose_with_grounds(
        model,
        first,
        list(options.days),
        reference=Kind.SESSION if kind is Kind.SESSIONS else options.reference,
        effects=options.rig.effects,
        envelope=envelope_of(options.rig.path),
        experiments=later,
    )
    assert isinstance(grounds, Grounds)
    why = because(options.reference, grounds.expected.kind, model, len(options.days))
    return HuntFinding(replace(diagnosis, reference_because=why), grounds)


def _next(options: HuntOptions, finding: HuntFinding, seconds: float) -> Experiment | None:
    """The records that tell most of what is still possible, inside the rig's limits."""
    known, envelope = finding.grounds, envelope_of(options.rig.path)
    return what_next(known.expected, known.posteriors, envelope, seconds, simulator=known.simulator)


def _first(so_far: Hunt, options: HuntOptions) -> Hunt:
    """The hunt with the session that it begins with."""
    path = shipped.find_config(options.first, "sweeps")
    for plan in expand(load_sweep(path), options.rig.period_ns):
        check_run(plan, options.rig.limits, options.rig.period_ns)
    minutes = lasting_s(resting(load_sweep(path))) / 60.0
    if not minutes <= options.minutes + ROUNDING_MIN:  # of no number at all nothing is allowed
        raise ConfigError(
            f"--minutes {options.minutes:g}: the session that a hunt begins with ({path.stem}) takes {minutes:.1f}; "
            "allow as many, or name a shorter one by --sweep"
        )
    return _planned(
        so_far, text_from(path, so_far.folder), f"the session that a hunt begins with ({path.stem})", minutes
    )


def _with_step(so_far: Hunt, planned: Experiment, channels: Channels) -> Hunt:
    number, what = len(so_far.steps) + 1, planned.why(channels)
    why = f"to tell {' from '.join(planned.separates)}: {what}, {planned.weakest:.1f} standard deviations apart"
    return _planned(so_far, planned.sweep(f"step_{number}"), why, planned.seconds / 60.0)


def _planned(so_far: Hunt, sweep: str, why: str, minutes: float) -> Hunt:
    """The hunt with one more step, its sweep written, nothing recorded yet."""
    name = f"step_{len(so_far.steps) + 1}.yaml"
    so_far.folder.mkdir(parents=True, exist_ok=True)
    write_text(so_far.folder / name, sweep, Output.SWEEP)
    so_far = replace(so_far, steps=(*so_far.steps, HuntStep(name, why, minutes)))
    so_far.save()
    return so_far


def _barred(options: HuntOptions, so_far: Hunt, allowed: Callable[[HuntStep], bool]) -> str:
    """Why the last step is not to be recorded; empty where it may be, or the daemon records it already."""
    step = so_far.steps[-1]
    if _at_hand(options, so_far):
        return ""
    if not so_far.minutes + step.minutes <= options.minutes + ROUNDING_MIN:
        return TIME
    return "" if allowed(step) else "not confirmed"


def _at_hand(options: HuntOptions, so_far: Hunt) -> bool:
    """The daemon records the last step already, or has: a hunt before this one asked it to."""
    step, daemon = so_far.steps[-1], options.daemon
    if daemon is None or step.since is None:
        return False
    return at_hand(daemon.status(), so_far.folder / step.sweep, step.since)


def _recorded(so_far: Hunt, options: HuntOptions) -> Hunt:
    """The hunt with the records of its last step; what an earlier try left stays in a folder of its own.
    CheckFailed when they are not all valid."""
    number = len(so_far.steps)
    folder = _unused(so_far.folder, f"step_{number}_records")
    try:
        if options.daemon is not None:
            so_far = _by_daemon(options.daemon, so_far, options, folder)
        else:
            _here(options, so_far.folder / so_far.steps[-1].sweep, so_far.folder / folder, number)
    finally:
        with suppress(OSError):  # a folder with anything in it cannot be removed so
            (so_far.folder / folder).rmdir()
    so_far = so_far.with_last(replace(so_far.steps[-1], records=folder))
    so_far.save()
    return so_far


def _unused(place: Path, name: str) -> str:
    """That name, or the first one like it, under which nothing lies in a folder."""
    names = chain([name], (f"{name}_again{number}" for number in count(1)))
    return next(one for one in names if not any(place.glob(f"{one}/*")))


def _here(options: HuntOptions, sweep: Path, out: Path, number: int) -> None:
    """One sweep in this process, its records in `out`."""
    seed = None if options.seed is None else options.seed + number - 1
    outcome: RunOutcome = run_sweep(sweep, options.rig, SweepOptions(out, options.virtual, seed, options.force))
    outcome.judge()


def _by_daemon(daemon: Client, so_far: Hunt, options: HuntOptions, folder: str) -> Hunt:
    """One sweep as a job of the daemon, which must be armed and have nothing else to do. From when on a job may be this
    step's is on the disk before the daemon hears of it, so that a kill at any moment leaves no record unknown."""
    step = so_far.steps[-1]
    sweep = so_far.folder / step.sweep
    if not _at_hand(options, so_far):
        status = daemon.status()
        check_free(status)
        step = replace(step, since=last_job(status))
        so_far = so_far.with_last(step)
        so_far.save()
        daemon.start(sweep, before="leave")
    assert step.since is not None
    taken(daemon, sweep, step.since, so_far.folder / folder)
    return so_far


def _ended(so_far: Hunt, finding: HuntFinding | None, how: str) -> Hunted:
    so_far = replace(so_far, ended=how)
    so_far.save()
    return Hunted(so_far, finding)


def hunt_and_tell(
    options: HuntOptions,
    allowed: Callable[[HuntStep], bool],
    report: Callable[[HuntStep], None],
    tell: Callable[[Hunted], None],
) -> Hunted:
    """`hunt`, with its result given to `tell` and its pages written, also of a hunt that the rig, the daemon, the disk
    or somebody cut short: what was learnt so far is kept and said. StateError while another hunt is at work in the
    folder."""
    with alone_in(options.folder):
        return _told(options, allowed, report, tell)


def _told(
    options: HuntOptions,
    allowed: Callable[[HuntStep], bool],
    report: Callable[[HuntStep], None],
    tell: Callable[[Hunted], None],
) -> Hunted:
    learnt: list[HuntFinding] = []

    def keep(step: HuntStep, finding: HuntFinding) -> None:
        learnt.append(finding)
        report(step)

    try:
        found = hunt(options, allowed, keep)
    except (RigError, OSError, Interrupted, KeyboardInterrupt) as error:
        _tell_cut(options, learnt, error, tell)
        raise
    tell(found)
    _write_pages(options, found)
    return found


def _tell_cut(
    options: HuntOptions, learnt: Sequence[HuntFinding], error: BaseException, tell: Callable[[Hunted], None]
) -> None:
    """Say what a hunt that was cut short has learnt, where it had begun, also when its folder is gone; a page that
    cannot be written either is not what it ended by."""
    if not learnt and not (options.folder / FILE).exists():
        return
    so_far = open_hunt(options.folder, options.asked)
    cut = Hunted(so_far, learnt[-1] if learnt else None, cut_short_by=str(error) or "interrupted")
    with suppress(RigError, OSError):
        _write_pages(options, cut)
    tell(cut)


def _write_pages(options: HuntOptions, found: Hunted) -> None:
    """hunt.html, the story, and report.html, the last diagnosis."""
    folder, finding = options.folder, found.finding
    if not folder.is_dir():
        return
    if finding is not None:
        model = load_model(shipped.find_config(options.model, "models"))
        write_page(folder / "report.html", finding.diagnosis, finding.grounds, model, {"Rig": options.rig.name})
    steps = [
        ToldStep(step.sweep, step.why, f"{step.minutes:.1f}", step.set if step.done else ())
        for step in found.hunt.steps
    ]
    write_hunt(
        folder / "hunt.html",
        options.rig.name,
        steps,
        found.hunt.minutes,
        found.ended,
        None if finding is None else finding.diagnosis,
        "report.html" if finding is not None else "",
    )
