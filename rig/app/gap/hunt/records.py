"""The records of a hunt's last step: made here, or as a job of a daemon that may have made them already."""

from contextlib import suppress
from dataclasses import replace
from itertools import chain, count
from pathlib import Path

from rig.app.gap.hunt.daemon_jobs import at_hand, check_free, last_job, taken
from rig.app.gap.hunt.folder import Hunt
from rig.app.gap.hunt.options import HuntOptions
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.sweeping import SweepOptions, run_sweep
from rig.service.client import Client


def recorded(so_far: Hunt, options: HuntOptions) -> Hunt:
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
    return next(each for each in names if not any(place.glob(f"{each}/*")))


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
    if not daemon_has_it(options, so_far):
        status = daemon.status()
        check_free(status)
        step = replace(step, since=last_job(status))
        so_far = so_far.with_last(step)
        so_far.save()
        daemon.start(sweep, before="leave")
    assert step.since is not None
    taken(daemon, sweep, step.since, so_far.folder / folder)
    return so_far


def daemon_has_it(options: HuntOptions, so_far: Hunt) -> bool:
    """The daemon records the last step already, or has: a hunt before this one asked it to."""
    step, daemon = so_far.steps[-1], options.daemon
    if daemon is None or step.since is None:
        return False
    return at_hand(daemon.status(), so_far.folder / step.sweep, step.since)
