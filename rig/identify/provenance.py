"""Which records a model was identified on, by the content of their files, and where those files are now."""

import hashlib
import os
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

from rig.identify.records.data import Prepared
from rig.identify.validate import Score
from rig.log.log_files import is_named_like_one
from rig.model.parameters import Model, Provenance, SourceLog
from rig.record import Record

FITTED_AGAIN: Final = "Its own parameters fitted again by pamrig gap diagnose."
"""What the provenance of a model says whose parameters a diagnosis has re-tuned."""


def provenance(
    data: Sequence[Prepared], scores: Sequence[Score], rmse: float, search: tuple[str, int, int]
) -> Provenance:
    """Where a model comes from; `search` is the optimiser's name, its first seed, and the evaluations that were
    spent."""
    logs = [
        SourceLog(str(each.record.source or ""), _digest(each.record.source), each.record.name, round(row.rmse_deg, 6))
        for each, row in zip(data, scores, strict=True)
    ]
    try:
        program = version("pamrig")
    except PackageNotFoundError:
        program = ""
    return Provenance("", logs, rmse, *search, program)


def find_logs(model: Model, folder: Path | None = None) -> tuple[list[Path], list[str]]:
    """The files that `model` was identified on: where they were, or anywhere in `folder`, by their SHA-256.

    The second list says of each file that is not found what is there instead.
    """
    wanted = {log.sha256: Path(log.file) for log in model.provenance.logs if log.sha256}
    found = {digest: path for digest, path in wanted.items() if _digest(path) == digest}
    missing = wanted.keys() - found.keys()
    if folder is not None and missing:
        found |= _search(folder, missing, {path.name for path in wanted.values()})
    return [found[digest] for digest in wanted if digest in found], [
        f"{path}: {'its content has changed since the identification' if os.path.isfile(path) else 'no such file'}"
        + ("" if folder is None else f", nor is it in {folder}")
        for digest, path in wanted.items()
        if digest not in found
    ]


def identified_on(model: Model, records: Sequence[Record]) -> list[str]:
    """Names of the records that `model` was identified on, by the SHA-256 of their files."""
    logs = {log.sha256 for log in model.provenance.logs if log.sha256}
    return [record.name for record in records if logs and _digest(record.source) in logs]


def tuned_to(model: Model, records: Sequence[Record]) -> str:
    """Whether `model` was fitted to these records, as its file tells: what follows "The model ..." in a sentence."""
    same = identified_on(model, records)
    if len(same) == len(records) > 0:
        return "was identified on these very records"
    if same:
        return f"was identified on {len(same)} of these {len(records)} records ({', '.join(same[:3])})"
    if FITTED_AGAIN in model.provenance.text:
        return "was fitted again by a diagnosis; its file does not say to which records"
    if not model.provenance.logs or any(record.source is None for record in records):
        return "does not say which records it was tuned to"
    return "was not tuned to these records"


def _search(folder: Path, missing: set[str], names: set[str]) -> dict[str, Path]:
    """Files below `folder` with one of these digests; those of the same name are looked at first."""
    left, found = set(missing), dict[str, Path]()
    files = filter(is_named_like_one, folder.rglob("*"))
    for path in sorted(files, key=lambda path: (path.name not in names, str(path))):
        if not left:
            break
        if (digest := _digest(path)) in left:
            found[digest] = path
            left.remove(digest)
    return found


def _digest(path: Path | None) -> str:
    """SHA-256 of a file; empty where there is none."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path is not None and os.path.isfile(path) else ""
