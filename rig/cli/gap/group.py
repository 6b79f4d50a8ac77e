"""`pamrig gap`: the commands on the gap between simulator and rig, a file each or two."""

import click

from rig.cli.gap.check import check
from rig.cli.gap.diagnose import diagnose
from rig.cli.gap.history import history
from rig.cli.gap.hunt import hunt
from rig.cli.gap.library import calibrate, effects
from rig.cli.gap.plan import capability, design
from rig.cli.gap.study import study
from rig.cli.outputs import Group


@click.group(cls=Group)
def gap() -> None:
    """Where the gap between simulator and rig lies, which effect causes it, how far it shrinks."""


for _command in (diagnose, history, effects, capability, design, hunt, check, calibrate, study):
    gap.add_command(_command)
