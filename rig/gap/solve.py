"""Another name of `rig.identify.descent`, for the rooms of the diagnosis that still ask for it here."""

from rig.identify.descent import Fit, descend

__all__ = ["Fit", "descend"]
