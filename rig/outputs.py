"""One rule for whatever a command writes: nothing that somebody may still need is lost by it.

A new file is written under another name beside its place and takes the name when it is whole. A file that exists is
replaced only by one of its own kind: a page by a page, a model by a model. A recording is never replaced. What appears
at its place during the work is such a file too. Standard library only.
"""

import contextlib
import errno
import itertools
import os
import re
import secrets
import stat
from collections.abc import Callable, Hashable, Iterable, Iterator
from enum import Enum
from pathlib import Path
from typing import Final

from rig.errors import RecordError, RigError

_HEAD_BYTES: Final = 1 << 16
NO_LINKS: Final = (errno.EPERM, errno.ENOTSUP, errno.ENOSYS, errno.EXDEV, errno.EMLINK)
"""What a file system without hard links, such as FAT, says of one."""
_NAME_BYTES: Final = 100
_MOST_LINKS: Final = 40
"""That Linux follows in one path."""
_holds_descriptors: Final = re.compile(r"/proc/(self|\d+)(/task/\d+)?/fd").fullmatch
UNFINISHED: Final = ".writing"
"""How the name of a file ends that a command has not finished."""
FIGURE_SUFFIXES: Final = (".png", ".svg", ".pdf")
_FIGURE_HEADS: Final = {".png": b"\x89PNG", ".pdf": b"%PDF"}


class OutputKind(Enum):
    """What a file written by a command is; the value is its name in a message."""

    JSON = "a JSON file"
    PAGE = "an HTML page"
    TABLE = "a table of scores"
    FIGURE = "a figure"
    MODEL = "a model"
    SWEEP = "a sweep"
    CALIBRATION = "a calibration"
    LEVELS = "fitted levels"
    HUNT = "a hunt's notes"
    METRICS = "a daemon's metrics"
    MAPPING = "a mapping"
    RIG = "a rig"
    RECORDING = "a recording"
    """Never replaced, not even by another."""
    FOLDER = "a folder"


_begins_like_yaml: Final = re.compile(rb"(?:[ \t]*(?:#[^\n]*)?\r?\n|---[^\n]*\n|%[^\n]*\n)*[\w\"'][^\n:]*:").match
"""Somebody's notes with a piece of YAML among them do not."""


def _key(*names: bytes) -> Callable[[bytes], bool]:
    """Whether a YAML file has one of these keys at its top level."""
    pattern = re.compile(rb"^(?:%s):" % b"|".join(names), re.MULTILINE)
    return lambda head: _begins_like_yaml(head) is not None and pattern.search(head) is not None


_is_model: Final = _key(b"muscle")
_is_hunt: Final = re.compile(rb'\A\{\s*"version": \d+,\s*"asked": \{').search
_is_seal: Final = re.compile(rb'^ "format": "pamrig blind check', re.MULTILINE).search
_has_table: Final = re.compile(rb"^\| ?:?-", re.MULTILINE).search
_KEPT_JSON: Final = (".ipynb", ".jsonl", "-metadata.json")
"""Ends of names of JSON that is no result: notebooks, ledgers, the facts beside an exported CSV."""


_SIGNS: Final[dict[OutputKind, Callable[[bytes], bool]]] = {
    OutputKind.LEVELS: lambda head: (
        _key(b"provenance")(head) and not _is_model(head)
    ),  # a model says where it is from, too
    OutputKind.JSON: lambda head: head.lstrip()[:1] in (b"{", b"[") and not _is_hunt(head) and not _is_seal(head),
    OutputKind.HUNT: lambda head: _is_hunt(head) is not None,
    OutputKind.METRICS: lambda head: head.startswith(b"# HELP pamrig_"),
    OutputKind.PAGE: lambda head: head.lstrip()[:5].lower() in (b"<!doc", b"<html"),
    OutputKind.TABLE: lambda head: head.startswith((b"record,", b"| record")),
    OutputKind.MODEL: _is_model,
    OutputKind.SWEEP: _key(b"records"),
    OutputKind.MAPPING: _key(b"columns"),
    OutputKind.RIG: _key(b"devices"),
    OutputKind.CALIBRATION: _key(rb"valve_\d+", rb"monitor_\d+", b"angle"),
}
"""How a file shows its kind in its first bytes."""


def check_place(path: Path, kind: OutputKind, *, make_folder: bool = False) -> None:
    """RigError, one line, when nothing of that kind may be written to `path`. To be asked before the work; `writing`
    asks again.

    With `make_folder` its folder need not be there yet.
    """
    if kind is OutputKind.FIGURE and path.suffix.lower() not in FIGURE_SUFFIXES:
        raise RigError(f"{path}: a figure is written as {', '.join(FIGURE_SUFFIXES)}")
    try:
        why = _refusal(path, kind, make_folder)
    except (OSError, ValueError):
        why = "no file can have that name"
    if why:
        raise RigError(f"{path}: cannot be written: {why}")
    if os.path.isfile(path) and kind is not OutputKind.FOLDER:
        _check_replaceable(path, kind)


def _refusal(path: Path, kind: OutputKind, make_folder: bool) -> str:
    """What stands against the place itself; empty for nothing."""
    if kind is OutputKind.FOLDER:
        make_folder = True
        if os.path.isdir(path):
            return "" if os.access(path, os.W_OK) else "not allowed there"
    if os.path.exists(path) and os.path.isdir(path) != (kind is OutputKind.FOLDER):
        return "it is a folder" if os.path.isdir(path) else "it is a file, and a folder is wanted"
    if _is_stream(path):
        return "" if os.access(path, os.W_OK) else "not allowed there"
    if _is_descriptor(path) and os.path.isfile(path):
        return "it leads into a file, where more may stand; name a file of its own"
    above = path.resolve().parent
    while make_folder and not above.exists():
        above = above.parent
    if not above.is_dir():
        return "no such folder"
    return "" if os.access(above, os.W_OK) else "not allowed there"


def check_apart(outputs: Iterable[tuple[str, Path]], inputs: Iterable[tuple[str, Path]]) -> None:
    """RigError when two outputs, or an output and an input, are one file; each comes with the name of its option."""
    taken = {_same(path): f"{name} reads" for name, path in inputs if not os.path.isdir(path)}
    for name, path in outputs:
        if os.path.isdir(path) or _is_stream(path):
            continue
        here = _same(path)
        if here in taken:
            raise RigError(f"{name} {path}: that is the file which {taken[here]}; give each output a file of its own")
        taken[here] = f"{name} writes"


def make_folder(path: Path) -> None:
    """A folder and those on the way to it; RigError when one cannot be made."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RigError(f"{path}: cannot be made: {error.strerror}") from None


@contextlib.contextmanager
def writing(path: Path, kind: OutputKind) -> Iterator[Path]:
    """The place to write to, which becomes `path` at the end and vanishes after an error; folders on the way are made.

    Its name has no suffix: what is left of a command that was killed passes for nothing that somebody looks for in a
    folder. What has come to lie there meanwhile is judged by the same rule; where it stays, what was written stays
    beside it.

    RigError when nothing of that kind may be written there, or the disk refuses.
    """
    check_place(path, kind, make_folder=True)
    target = path.resolve()
    part = path if _is_stream(path) else target.with_name(f".{secrets.token_hex(6)}{UNFINISHED}")
    make_folder(target.parent)
    try:
        yield part
        if part is not path:
            _finish(part, target, kind)
    except OSError as error:
        raise RigError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        if part is not path:
            part.unlink(missing_ok=True)


def write_text(path: Path, text: str, kind: OutputKind) -> None:
    """Write a whole text file by the rule; a name in it that is no UTF-8 is spelled out."""
    with writing(path, kind) as part:
        part.write_bytes(text.encode("utf-8", "backslashreplace"))


def file_name(name: str) -> str:
    """A name from a file or a network as the name of a file: in one folder, visible, of a length that every disk
    takes."""
    plain = re.sub(r"[^\w.+-]+", "-", name).strip(".-")
    while len(plain.encode()) > _NAME_BYTES:
        plain = plain[:-1]
    return plain or "record"


def check_free(targets: Iterable[Path]) -> None:
    """RecordError where a log is to be written and something stands already."""
    for target in targets:
        if os.path.lexists(target):
            raise RecordError(f"{target}: exists already; a log is never overwritten")


def targets_in(folder: Path, names: Iterable[str], suffix: str) -> list[Path]:
    """A file in `folder` for each name, in order; what would be the same file twice (repeats, other sessions) gets a
    number."""
    made: list[Path] = []
    taken: set[str] = set()
    for name in names:
        plain = file_name(name)
        numbered = (plain if n == 1 else f"{plain}_{n}" for n in itertools.count(1))
        free = next(
            each for each in numbered if each.lower() not in taken
        )  # a disk may take capitals for small letters
        taken.add(free.lower())
        made.append(folder / f"{free}{suffix}")
    return made


def _check_replaceable(path: Path, kind: OutputKind) -> None:
    if kind is OutputKind.RECORDING:
        raise RigError(f"{path}: exists already and is not overwritten; give another name")
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise RigError(f"{path}: cannot be written: {error.strerror}") from None
    if head and not _shows(path, head, kind):
        raise RigError(f"{path}: exists already and is not {kind.value}; it is not overwritten")


def _shows(path: Path, head: bytes, kind: OutputKind) -> bool:
    if kind is OutputKind.FIGURE and (sign := _FIGURE_HEADS.get(path.suffix.lower())):
        return head.startswith(sign)
    if b"\0" in head:  # a recording keeps rig, sweep and model in its first bytes, word for word
        return False
    if path.suffix.lower() == ".md" and kind is OutputKind.PAGE:
        return head.startswith((b"#", b"|")) and _has_table(head) is not None  # somebody's notes have none
    if kind is OutputKind.FIGURE:
        return b"<svg" in head
    return not path.name.endswith(_KEPT_JSON) and _SIGNS[kind](head)


def _finish(part: Path, target: Path, kind: OutputKind) -> None:
    """Onto the disk, then under its name; a file that was there keeps its mode."""
    descriptor = os.open(part, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    try:
        if not _took_free_name(part, target):
            check_place(target, kind)
            part.chmod(stat.S_IMODE(target.stat().st_mode))
            part.replace(target)
        keep_names(target.parent)
    except RigError as error:
        kept = target.with_name(f"{target.stem}{part.name.removesuffix(UNFINISHED)}{target.suffix}")
        part.rename(kept)
        raise RigError(f"{error}; it came while this was at work, whose result is {kept}") from None


def keep_names(folder: Path) -> None:
    """The names of a folder onto the disk, too, after a file there has taken one: what was on it then is not found
    under another, or none, when the power fails. Not every file system can (OSError is let pass)."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _took_free_name(part: Path, target: Path) -> bool:
    """Give the file that name; False when something has it."""
    try:
        os.link(part, target)  # unlike a rename, takes nobody's name
    except FileExistsError:
        return False
    except OSError as error:
        if error.errno not in NO_LINKS:
            raise
        with contextlib.suppress(FileExistsError):
            os.close(os.open(target, os.O_CREAT | os.O_EXCL | os.O_WRONLY))  # the name is ours now, and is empty
            part.replace(target)
            return True
        return False
    return True


def _same(path: Path) -> Hashable:
    """What is equal for two ways to say one file: device and inode, or the resolved path of what is not there yet."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return os.path.realpath(path)
    return found.st_dev, found.st_ino


def _is_descriptor(path: Path) -> bool:
    """/dev/stdout, /dev/fd/3: what this process has open. A file there would not be written to but replaced, with all
    that was in it or comes into it by the descriptor."""
    for _ in range(_MOST_LINKS):
        if _holds_descriptors(os.path.realpath(path.parent)):
            return True
        if not path.is_symlink():
            return False
        path = path.parent / path.readlink()
    return False


def _is_stream(path: Path) -> bool:
    """/dev/null, /dev/stdout, a pipe: written to as it stands."""
    return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)
