"""What `pamrig gap check` does: the generator of its cases, sealing them, and spreading the work over processes or a
cluster."""

import secrets
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from hil.reference.cases import Purpose
from hil.reference.names import NAMES as FAMILIES
from hil.reference.source import PhysicsSource
from rig.app.gap.baselines import days_in
from rig.app.shipped import find_config
from rig.app.terminal import progress
from rig.blind_check.folder import CheckFolder
from rig.blind_check.follow_up import commands_of
from rig.blind_check.generate import draw, open_labels
from rig.blind_check.modes import GROUPS, measures_of, names_of
from rig.blind_check.real_source import RecordsSource
from rig.blind_check.source import Source
from rig.errors import ConfigError, RecordError
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.priors import fitted
from rig.number_text import counted
from rig.outputs import make_folder
from rig.parallel import each, executor

DAYS_NEED = 2
"""Earlier days, beside the one with the effect, from which on several days can be asked for."""


def source_of(
    development: bool,
    families: Sequence[str],
    groups: Sequence[str] = tuple(GROUPS),
    sweep: Path | None = None,
    own_zero: bool = False,
) -> Source:
    """The generator: this is the only place that knows both it and the check. Effects that the library lacks are not
    asked for. With a `sweep` every day is recorded under it; with `own_zero` each record takes the angle at rest for
    zero."""
    purpose = Purpose.DEVELOPMENT if development else Purpose.SCORING
    session = None if sweep is None else commands_of(find_config(sweep, "sweeps"))
    measures = measures_of(groups or GROUPS)
    return PhysicsSource(purpose, tuple(families) or FAMILIES, measures, tuple(LIBRARY), session, own_zero)


def source_and_modes(
    records: Path | None,
    development: bool,
    families: Sequence[str] = (),
    groups: Sequence[str] = (),
    sweep: Path | None = None,
    own_zero: bool = False,
) -> tuple[Source, tuple[str, ...]]:
    """The generator, plants or somebody's records, and the ways of asking; ConfigError for one that records do not
    allow."""
    if records is None:
        return source_of(development, families, groups, sweep, own_zero), tuple(groups)
    if families or sweep or own_zero:
        option = "--family" if families else "--sweep" if sweep else "--own-zero"
        raise ConfigError(f"{option}: is for plants; --records takes no plant, give one of the two")
    return RecordsSource(records), _modes_of(records, groups)


def _modes_of(records: Path, groups: Sequence[str]) -> tuple[str, ...]:
    sessions = len(days_in(records)) or 1
    can = tuple(name for name in ("days", "one_day", "fingerprint") if name != "days" or sessions > DAYS_NEED)
    if lacking := next((name for name in groups if name not in can), None):
        raise ConfigError(
            f"--modes {lacking}: cannot be asked of {records} ({counted(sessions, 'session')}); "
            f"allowed: {', '.join(can)}; days needs {DAYS_NEED + 1} sessions, a folder each"
        )
    return tuple(groups) or can


def source_of_labels(folder: CheckFolder) -> Source:
    """The generator that the labels of a sealed check are of: plants, or somebody's records, which the steps after the
    making have no need of."""
    labels, _ = open_labels(folder)
    first = next(iter(labels.values()))
    return RecordsSource(Path(first["family"])) if "held" in first else PhysicsSource()


def seal(
    source: Source,
    folder: CheckFolder,
    cases: int,
    seed: int | None,
    groups: Sequence[str] = (),
    angle: bool = True,
    priors: Path | None = None,
) -> str:
    """Seal the labels, or go on with those that are there; their SHA-256, before anything is computed.

    `priors`: the levels to answer by, kept beside the seal. ConfigError when they are none, or not those of the check
    that is there.
    """
    if priors is not None:
        fitted(priors)
    if folder.sealed.exists():
        _check_same_priors(folder, priors)
        seed = open_labels(folder)[1] if seed is None else seed
    else:
        _keep_priors(folder, priors)
    return draw(
        source,
        folder.root,
        secrets.randbits(48) if seed is None else seed,
        cases,
        names_of(groups or GROUPS, angle),
    )


def _check_same_priors(folder: CheckFolder, priors: Path | None) -> None:
    """ConfigError where the answers of a check would be by two sorts of levels."""
    kept = folder.priors.read_bytes() if folder.priors.exists() else None
    if priors is not None and priors.read_bytes() != kept:
        by = "the shipped levels" if kept is None else f"other levels ({folder.priors})"
        raise ConfigError(f"--priors {priors}: {folder.root} holds a check that is answered by {by}; name another -o")


def _keep_priors(folder: CheckFolder, priors: Path | None) -> None:
    """Those of a new check, before its seal: one that is killed between the two begins anew."""
    if priors is None:
        folder.priors.unlink(missing_ok=True)
        return
    make_folder(folder.root)
    folder.priors.write_bytes(priors.read_bytes())


def questions_in(place: CheckFolder) -> list[str]:
    """The names of the questions; RecordError when there are none."""
    tokens = (
        sorted(path.name for path in place.questions.iterdir() if path.is_dir()) if place.questions.is_dir() else []
    )
    if not tokens:
        raise RecordError(f"{place.questions}: no questions; `pamrig gap check make {place.root}` writes them")
    return tokens


def spread(
    work: Callable[[Any], Any], pieces: Sequence[Any], total: int, what: str, dask: str | None, workers: int | None
) -> None:
    """Do the pieces over processes or a cluster; each returns how many of `total` it was worth."""
    done = 0
    with executor(dask, workers) as pool, progress(what, total) as update:
        for count in each(pool, work, pieces):
            done += count if isinstance(count, int) else 1
            update(done, f"{done} of {total} {what}")
