"""What `pamrig gap hunt` does: run a session, diagnose, run the records that part what is still possible, join the
evidence, until one name is left, nothing is found, nothing parts the rest, or the time is over."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from rig.app import shipped
from rig.app.gap.hunt.folder import Hunt, HuntStep, open_hunt
from rig.app.gap.hunt.options import HuntOptions
from rig.app.gap.hunt.records import daemon_has_it, recorded
from rig.app.gap.planning import resting
from rig.app.gap.sweep_envelope import envelope_of
from rig.app.runs.sweeping import text_from
from rig.app.terminal import progress
from rig.channels import Channels
from rig.errors import ConfigError
from rig.excite.envelope import check_run
from rig.excite.run_plan import expand
from rig.excite.sweep import load_sweep
from rig.gap.answer.result import Diagnosis
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.library import NONE, UNKNOWN
from rig.gap.pipeline import Grounds
from rig.gap.plan.candidates import lasting_s
from rig.gap.plan.experiment import Experiment
from rig.gap.plan.next_experiment import what_next
from rig.gap.reference.kinds import because, choose
from rig.gap.settings import CREDIBLE
from rig.log.reader import read
from rig.model.parameters import Model, load_model
from rig.outputs import OutputKind, write_text

NAMED, NOTHING, TIME = "named", "nothing parts the rest", "time"
NO_GAP, NO_NAME = "no cause found", "something unknown"
ROUNDING_MIN = 1e-6
"""Sums of minutes closer than this to what is allowed count as allowed."""


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
        so_far = _with_first_session(so_far, options)
    elif len(so_far.steps) > 1 and not so_far.steps[-1].done:
        finding = diagnose_so_far(options, model, so_far)
        report(so_far.steps[-2], finding)
    so_far = replace(so_far, ended="")
    while True:
        if not so_far.steps[-1].done:
            if why := _why_not_to_record(options, so_far, allowed):
                return _ended(so_far, finding, why)
            so_far.require_folder()
            so_far = recorded(so_far, options)
        with progress(f"diagnosing after step {len(so_far.steps)}"):
            finding = diagnose_so_far(options, model, so_far)
        so_far = so_far.with_last(replace(so_far.steps[-1], set=finding.names))
        report(so_far.steps[-1], finding)  # before its file: it is said where that cannot be written
        so_far.require_folder()
        so_far.save()
        if finding.settled:
            return _ended(so_far, finding, finding.settled)
        left_s = 60.0 * (options.minutes - so_far.minutes)
        with progress("planning what tells more"):
            planned = _next_experiment(options, finding, left_s)
            more = planned or _next_experiment(options, finding, 3600.0)
        if planned is None:
            return _ended(so_far, finding, NOTHING if more is None else TIME)
        so_far = _with_step(so_far, planned, options.rig.channels)


def diagnose_so_far(options: HuntOptions, model: Model, so_far: Hunt) -> HuntFinding:
    """The diagnosis of all records so far."""
    first, *later = [read(so_far.folder / step.records) for step in so_far.steps if step.done]
    diagnosis, grounds = diagnose_with_grounds(
        model,
        first,
        list(options.days),
        reference=options.reference,
        rig_effects=options.rig.effects,
        envelope=envelope_of(options.rig.path),
        experiments=later,
    )
    assert isinstance(grounds, Grounds)
    why = because(options.reference, grounds.expected.kind, model, len(options.days))
    return HuntFinding(replace(diagnosis, reference_because=why), grounds)


def _next_experiment(options: HuntOptions, finding: HuntFinding, seconds: float) -> Experiment | None:
    """The records that tell most of what is still possible, inside the rig's limits."""
    known, envelope = finding.grounds, envelope_of(options.rig.path)
    return what_next(known.expected, known.posteriors, envelope, seconds, simulator=known.simulator)


def _with_first_session(so_far: Hunt, options: HuntOptions) -> Hunt:
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
    write_text(so_far.folder / name, sweep, OutputKind.SWEEP)
    so_far = replace(so_far, steps=(*so_far.steps, HuntStep(name, why, minutes)))
    so_far.save()
    return so_far


def _why_not_to_record(options: HuntOptions, so_far: Hunt, allowed: Callable[[HuntStep], bool]) -> str:
    """Why the last step is not to be recorded; empty where it may be, or the daemon records it already."""
    step = so_far.steps[-1]
    if daemon_has_it(options, so_far):
        return ""
    if not so_far.minutes + step.minutes <= options.minutes + ROUNDING_MIN:
        return TIME
    return "" if allowed(step) else "not confirmed"


def _ended(so_far: Hunt, finding: HuntFinding | None, how: str) -> Hunted:
    so_far = replace(so_far, ended=how)
    so_far.save()
    return Hunted(so_far, finding)
