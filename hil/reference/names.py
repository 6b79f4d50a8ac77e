"""The names of the plant families, for whoever asks for nothing else of them: no plant is imported."""

from typing import Final

NAMES: Final = ("mckibben", "fluidic", "pleated", "bellows", "bundle", "sleeve", "airbeam", "diaphragm", "pouch")
"""In each folder of that name: the equations (`plant`) and the table of effects (`other_laws`)."""
JUDGE: Final = "pouch"
"""The family on which nothing is fitted unless it is named, and by which no law was chosen: its figures count. Nobody
had looked at it when 900730 was scored; its healthy cases by days have been looked at since (0656), single effects have
not."""
DESIGNED_FOR: Final = ("mckibben", "fluidic", "pleated", "bellows")
"""Those whose rigs a session is designed on unless others are named; each more takes as long again as one of these."""
STEPPED: Final = ("mckibben", "fluidic")
"""Those that a controller can drive, with a module `stepped` in their folder."""
