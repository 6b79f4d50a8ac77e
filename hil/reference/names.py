"""The names of the plant families, for whoever asks for nothing else of them: no plant is imported."""

from typing import Final

NAMES: Final = ("mckibben", "fluidic", "pleated", "bellows", "bundle", "sleeve", "airbeam", "diaphragm")
"""In each folder of that name: the equations (`plant`) and the table of effects (`other_laws`)."""
JUDGE: Final = "diaphragm"
"""The family on which nothing is fitted, by which no law was chosen and at which nobody looked: its figures count."""
NOT_FITTED: Final = (JUDGE, "bundle", "sleeve", "airbeam")
"""Those on which nothing is fitted unless they are named. Single cases of the judge are not looked at either;
`airbeam`, which judged before it, still counts beside days, and has been looked at for simulators (0641)."""
STEPPED: Final = ("mckibben", "fluidic")
"""Those that a controller can drive, with a module `stepped` in their folder."""
