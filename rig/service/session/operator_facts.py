"""What of a device's facts an operator must know before anything moves."""

from collections.abc import Mapping
from typing import Final

_FOR_OPERATOR: Final = ("pace", "failsafe", "read_back", "warning")


def facts_for_operator(device: Mapping[str, str]) -> dict[str, str]:
    """Of a device's facts those that an operator must know before anything moves."""
    return {key: text for key, text in device.items() if _subject(key) in _FOR_OPERATOR}


def is_warning(key: str) -> bool:
    """Whether the fact of that name warns, be it the rig's or one part's of it (`2.warning`)."""
    return _subject(key) == "warning"


def _subject(key: str) -> str:
    return key.rpartition(".")[2]
