"""Compiles what most tests run, beside the linters: `python tests/machine_code.py`.

In a new checkout every process that needs a kernel before it lies on the disk compiles it, and two workers, their
daemons and the answering processes of the blind check would all do so at once.
"""

import sys

from support.plants.gap_rigs import asked, identified, session

from hil.reference.excitations import Excitation
from hil.reference.families import run, unit
from hil.reference.names import NAMES
from rig.model.parameters import AddedEffect


def main() -> int:
    """A diagnosis, an identification, and one second of a rig of each family of plants."""
    asked(session(1, AddedEffect("delay", {"delay_s": 0.03})))
    identified()
    for family in NAMES:
        rig = unit(family, 5)
        run(Excitation("sine", 1.0, 0.1, seconds=1.0), rig, rig.session(1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
