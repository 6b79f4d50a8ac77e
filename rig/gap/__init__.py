"""Diagnosis of the gap between simulator and rig: where it lies, which effect causes it, how far it shrinks.

`diagnose` is the entry; it is imported on first use, for it brings numpy and compiled code.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rig.gap.answer.result import Diagnosis
    from rig.gap.diagnosis import diagnose

__all__ = ["Diagnosis", "diagnose"]


def __getattr__(name: str) -> Any:
    if name == "diagnose":
        from rig.gap.diagnosis import diagnose

        return diagnose
    if name == "Diagnosis":
        from rig.gap.answer.result import Diagnosis

        return Diagnosis
    raise AttributeError(name)
