"""The notes of an answer as a person is told them: what holds of several records alike stands there once."""

from collections.abc import Sequence

EARLIER = "baseline "
"""How a note begins that is of a record of an earlier day."""
NAMED_RECORDS = 3
"""Records that one line lists by name; of more the others are counted."""


def folded(notes: Sequence[str]) -> list[str]:
    """The notes of a diagnosis in their order; those `NAME: TEXT` that say the same of different records as one, where
    the first stood."""
    alike: dict[tuple[bool, str], list[str]] = {}
    for note in notes:
        name, parted, text = note.removeprefix(EARLIER).partition(": ")
        alike.setdefault((note.startswith(EARLIER), text if parted else note), []).append(name if parted else "")
    return [_one_line(earlier, names, text) for (earlier, text), names in alike.items()]


def _one_line(earlier: bool, names: Sequence[str], text: str) -> str:
    """One text with the records that it is of."""
    if names == [""]:
        return text
    if len(names) == 1:
        return f"{EARLIER if earlier else ''}{names[0]}: {text}"
    listed = ", ".join(names[:NAMED_RECORDS])
    more = f" and {len(names) - NAMED_RECORDS} more" if len(names) > NAMED_RECORDS else ""
    return f"{len(names)} records{' of earlier days' if earlier else ''} ({listed}{more}): {text}"
