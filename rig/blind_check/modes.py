"""What is asked of a case: by which reference, with which simulator, with or without the measured pressures.

A mode is one column of the goals. Modes come in groups, which is what one chooses to run; a case is asked every mode of
the chosen groups whose gap is measured as the case's is.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

ALL_DAYS: Final = 99
"""More than a case has."""
OWN, BARE, SISTER = "own", "bare", "sister"
"""The unit's own model file, the same without its fingerprint, and one that was made for a sister."""
MOST_FOLLOW_UPS: Final = 2
"""Experiments that an answer may ask for, one after the other."""
DAYS, SISTERS = "days", "sisters"
"""What a gap is measured by: what healthy days differ by, or what rigs of one build do."""


@dataclass(frozen=True)
class Mode:
    """One way of asking."""

    name: str
    words: str
    reference: str
    """Passed to the diagnosis: auto, sessions, session, fingerprint or simulator."""
    days: int
    model: str = OWN
    pressures: bool = True
    against: str = DAYS
    withheld: str = ""
    """With a library that is short: the mode that asks the same with all of it."""

    @property
    def retunes(self) -> bool:
        """The simulator's own parameters are in doubt, so some effects are absorbed when they are fitted again."""
        return self.model != OWN


def _with_and_without(mode: Mode, alone: str) -> tuple[Mode, Mode]:
    """The mode, and the same from the angle alone."""
    values = {name: getattr(mode, name) for name in ("reference", "days", "model", "against")}
    return mode, Mode(alone, f"{mode.words}, angle only", pressures=False, **values)


GROUPS: Final[Mapping[str, tuple[Mode, ...]]] = {
    "days": (
        Mode("pressures", "days, with pressures", "sessions", ALL_DAYS),
        Mode("angle", "days, angle only", "sessions", ALL_DAYS, pressures=False),
    ),
    "one_day": _with_and_without(Mode("one_day", "one day", "session", 1), "one_day_angle"),
    "fingerprint": _with_and_without(Mode("fingerprint", "fingerprint", "fingerprint", 0), "fingerprint_angle"),
    "simulator": (
        *_with_and_without(
            Mode("simulator", "sister's simulator", "simulator", 0, SISTER, against=SISTERS), "simulator_angle"
        ),
        *_with_and_without(
            Mode("own_simulator", "own simulator, no fingerprint", "auto", 0, BARE, against=SISTERS),
            "own_simulator_angle",
        ),
    ),
    "withheld": (
        Mode("withheld", "days, short library", "sessions", ALL_DAYS, withheld="pressures"),
        Mode("withheld_angle", "days, angle only, short library", "sessions", ALL_DAYS, OWN, False, withheld="angle"),
        Mode("withheld_one_day", "one day, short library", "session", 1, withheld="one_day"),
        Mode("withheld_fingerprint", "fingerprint, short library", "fingerprint", 0, withheld="fingerprint"),
    ),
}
MODES: Final[Mapping[str, Mode]] = {mode.name: mode for group in GROUPS.values() for mode in group}
DEFAULT: Final = ("pressures", "angle")
"""Asked of records that somebody else brings."""


def names_of(groups: Iterable[str], angle: bool = True) -> list[str]:
    """The modes of some groups, with or without those that ask from the angle alone."""
    return [mode.name for group in groups for mode in GROUPS[group] if mode.pressures or angle]


def measures_of(groups: Iterable[str]) -> tuple[str, ...]:
    """What the gaps of their cases are measured by."""
    return tuple(dict.fromkeys(mode.against for group in groups for mode in GROUPS[group]))


def asked(modes: Iterable[str], label: Mapping[str, Any]) -> list[str]:
    """Which of the modes a case is asked: those that measure its gap as it was drawn."""
    return [name for name in modes if MODES[name].against == label.get("against", DAYS)]
