"""The process of a guardian without a loop to watch: in the place of a daemon without a session, which tries to make a
rig safe whose device is away, it tries when that one is killed or stopped."""

import os
from multiprocessing.connection import Connection

from rig.app.compose import wires_of
from rig.app.watcher_process import GoesOnAlone, claim_of, outside, speak, stay, try_for_commander
from rig.errors import StateError
from rig.realtime.safe_report import SafeBlock
from rig.realtime.safe_state import SecondPath
from rig.rig_config import RigConfig
from rig.service.processes import tell_commander
from rig.service.session.process_setups import WatcherSetup


def heir_process(setup: WatcherSetup, pipe: Connection) -> None:
    """Entry of a guardian without a loop to watch: it stands by until it is released or has made the rig safe."""
    stay(setup.writer)
    rig: RigConfig = setup.rig
    try:
        block = SafeBlock.attach(setup.block, setup.session)
    except StateError as error:
        tell_commander(pipe, "state", str(error))
        return
    alone = GoesOnAlone(rig, block, setup.writer)
    claim = claim_of(wires_of(rig), os.getppid())
    tell_commander(pipe, "ready", {})
    pipe.close()
    device = outside(rig, setup.options)
    try_for_commander(block, setup.writer, alone, SecondPath.of(device, claim))
    if alone.since_s:
        speak(block, setup.writer)
