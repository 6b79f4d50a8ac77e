"""The names of the plant families, for whoever asks for nothing else of them: no plant is imported."""

from typing import Final

NAMES: Final = ("mckibben", "fluidic", "pleated", "bellows", "bundle", "sleeve", "airbeam", "diaphragm")
"""In each folder of that name: the equations (`plant`) and the table of effects (`other_laws`)."""
JUDGE: Final = "diaphragm"
"""The family on which nothing is fitted, by which no law was chosen and at which nobody looks: its figures count."""
NOT_FITTED: Final = (JUDGE, "bundle", "sleeve", "airbeam")
"""Those on which nothing is fitted unless they are named; single cases of the judge are not looked at either."""
STEPPED: Final = ("mckibben", "fluidic")
"""Those that a controller can drive, with a module `stepped` in their folder."""
