"""Tags and notes of a session (muscle, load, who, why): short facts in the words of whoever ran it."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

from rig.errors import ConfigError

FACT: Final = "tags"
NOTE: Final = "note"
"""The run fact with a sentence or two about the session."""
Tags = Mapping[str, str | int | float]
MOST_TAGS: Final = 32
"""Of one session."""
LONGEST_TAG: Final = 200
"""Characters of a tag's name or value."""
LONGEST_NOTE: Final = 4000
"""Characters of the note."""


def check_tags(raw: Mapping[str, Any], where: str) -> dict[str, str | int | float]:
    """Tags themselves; ConfigError for too many, a name that is none, or a value that is neither text nor a number."""
    if len(raw) > MOST_TAGS:
        raise ConfigError(f"{where}: {len(raw)} tags; at most {MOST_TAGS} are kept")
    for name, value in raw.items():
        if not str(name).isidentifier() or len(str(name)) > LONGEST_TAG:
            raise ConfigError(f"{where}: {str(name)[:40]!r} is no name of a tag; letters, digits and _ are allowed")
        if isinstance(value, bool) or not isinstance(value, str | int | float) or len(str(value)) > LONGEST_TAG:
            raise ConfigError(f"{where}.{name}: expected text (at most {LONGEST_TAG} characters) or a number")
    return dict(raw)


def parse_tags(given: Iterable[str], where: str) -> dict[str, str | int | float]:
    """Tags written NAME=VALUE, numbers as numbers; ConfigError for anything else, and for a name that stands twice."""
    tags: dict[str, Any] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals:
            raise ConfigError(f"{where} {text[:40]!r}: expected NAME=VALUE, for example muscle=DMSP-10")
        if name in tags:
            raise ConfigError(f"{where} {name}: given twice")
        tags[name] = _number(value)
    return check_tags(tags, where)


def check_note(note: str | None, where: str) -> str | None:
    """The note; ConfigError when it is longer than a file should carry."""
    if note is not None and len(note) > LONGEST_NOTE:
        raise ConfigError(f"{where}: {len(note)} characters; at most {LONGEST_NOTE} are kept")
    return note or None


def tagged(facts: Mapping[str, Any], tags: Tags, note: str | None) -> dict[str, Any]:
    """Facts with tags and note added; of two tags with one name the new one holds."""
    known = facts.get(FACT)
    together = dict(known if isinstance(known, Mapping) else {}) | dict(tags)
    return dict(facts) | ({FACT: together} if together else {}) | ({NOTE: note} if note else {})


def tags_of(facts: Mapping[str, Any]) -> dict[str, str | int | float]:
    """The tags that facts hold; none where they hold something else."""
    raw = facts.get(FACT)
    try:
        return check_tags(raw, FACT) if isinstance(raw, Mapping) else {}
    except ConfigError:
        return {}


def tags_and_note(facts: Mapping[str, Any]) -> dict[str, str]:
    """Tags and note for a page or a terminal: heading -> text."""
    tags = ", ".join(f"{name} {value}" for name, value in tags_of(facts).items())
    note = facts.get(NOTE)
    return ({"Tags": tags} if tags else {}) | ({"Note": note} if isinstance(note, str) and note else {})


def _number(text: str) -> str | int | float:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
