"""The notes of an answer as a person is told them: what holds of several records alike stands there once."""

from collections.abc import Sequence

from rig.gap.answer.result import Diagnosis

EARLIER = "baseline "
"""How a note begins that is of a record of an earlier day."""
LISTED = 3
"""Records that one line lists by name; of more the others are counted."""


def told_notes(diagnosis: Diagnosis) -> list[str]:
    """The notes, in their order; those that say the same of different records as one, in place of the first."""
    return folded(diagnosis.notes)


def folded(notes: Sequence[str]) -> list[str]:
    """Notes `NAME: TEXT` with one text as one."""
    alike: dict[tuple[bool, str], list[str]] = {}
    for note in notes:
        name, parted, text = note.removeprefix(EARLIER).partition(": ")
        alike.setdefault((note.startswith(EARLIER), text if parted else note), []).append(name if parted else "")
    return [_told(earlier, names, text) for (earlier, text), names in alike.items()]


def _told(earlier: bool, names: Sequence[str], text: str) -> str:
    """One text with the records that it is of."""
    if names == [""]:
        return text
    if len(names) == 1:
        return f"{EARLIER if earlier else ''}{names[0]}: {text}"
    listed = ", ".join(names[:LISTED])
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return f"{len(names)} records{' of earlier days' if earlier else ''} ({listed}{more}): {text}"
