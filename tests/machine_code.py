"""Compiles what most tests run, beside the linters: `python tests/machine_code.py`.

In a new checkout every process that needs a kernel before it lies on the disk compiles it, and two workers, their
daemons and the answering processes of the blind check would all do so at once.
"""

import sys

from support.plants.gap_rigs import asked, identified, session

from hil.reference.cases import Purpose, bench_of, draw_sheet
from hil.reference.names import NAMES
from rig.model.parameters import AddedEffect


def main() -> int:
    """A diagnosis, an identification, and a rig of each family of plants."""
    asked(session(1, AddedEffect("delay", {"delay_s": 0.03})))
    identified()
    for family in NAMES:
        bench_of(draw_sheet(Purpose.DEVELOPMENT, seed=5, n=1, family_name=family)[0])
    return 0


if __name__ == "__main__":
    sys.exit(main())
