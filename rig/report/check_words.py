"""What the pages of a blind check call its modes and the naive answers beside it, and which figures of a family they
show."""

from rig.blind_check.modes import MODES

MODE_WORDS = {name: mode.words for name, mode in MODES.items()}
NAIVE_WORDS = {
    "always_none": "always none",
    "random": "random",
    "largest_rmse": "largest RMSE, best lag",
    "retuned": "re-tuned nominal",
}
FAMILY_FIGURES = (
    "false_alarms",
    "detected",
    "stage",
    "class_first",
    "exact_first",
    "truth_in_set",
    "unknown_flagged",
    "known_kept",
    "pairs_both",
)
MODES_A_TABLE = 2
"""Modes side by side in one table."""
