"""What `pamrig log compare` does between its arguments and rig.log.compare: reading both sides, drawing the pairs."""

from collections.abc import Iterator
from pathlib import Path

from rig.errors import RecordError
from rig.log.compare import Comparison, compare
from rig.log.reader import read
from rig.outputs import targets_in
from rig.report.log_figures import pair_figure, save


def compare_logs(a: Path, b: Path) -> Comparison:
    """Two logs or two folders beside each other; RecordError when nothing in them goes together."""
    return compare(read(a), read(b))


def draw_pairs(comparison: Comparison, output: Path) -> Iterator[Path]:
    """A figure of every pair: into the folder, or the file where there is one pair."""
    pairs = comparison.pairs
    if output.suffix and not output.is_dir():
        if len(pairs) > 1:
            raise RecordError(f"-o {output}: {len(pairs)} pairs need a figure each; give a folder")
        targets = [output]
    else:
        targets = targets_in(output, (pair.name for pair in pairs), ".svg")
    for pair, target in zip(pairs, targets, strict=True):
        target.parent.mkdir(parents=True, exist_ok=True)
        save(pair_figure(pair), target)
        yield target
