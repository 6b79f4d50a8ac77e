"""A hunt told to whoever called it, and on its pages; also one that the rig, the daemon, the disk or somebody cut
short."""

from collections.abc import Callable, Sequence
from contextlib import suppress

from rig.app import shipped
from rig.app.gap.hunt.folder import FILE, HuntStep, alone_in, open_hunt
from rig.app.gap.hunt.hunting import Hunted, HuntFinding, hunt
from rig.app.gap.hunt.options import HuntOptions
from rig.errors import Interrupted, RigError
from rig.model.parameters import load_model
from rig.report.gap_page import write_page
from rig.report.hunt_page import ToldStep, write_hunt


def hunt_and_tell(
    options: HuntOptions,
    allowed: Callable[[HuntStep], bool],
    report: Callable[[HuntStep], None],
    tell: Callable[[Hunted], None],
) -> Hunted:
    """`hunt`, with its result given to `tell` and its pages written, also of a hunt that the rig, the daemon, the disk
    or somebody cut short: what was learnt so far is kept and said. StateError while another hunt is at work in the
    folder."""
    learnt: list[HuntFinding] = []

    def keep(step: HuntStep, finding: HuntFinding) -> None:
        learnt.append(finding)
        report(step)

    with alone_in(options.folder):
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
