"""`pamrig devices` as its tests call it, and the rigs that they call it with."""

from dataclasses import dataclass
from pathlib import Path

from click.testing import CliRunner, Result

from drivers.myrio.device import MyRio
from hil.emulators.nifpga.stand_in import StandIn
from rig.cli.devices import devices
from rig.errors import RigError

RIGS = Path(__file__).resolve().parents[3] / "configs/rigs"
EMULATED = str(RIGS / "emulated_myrio.yaml")
SAFE = (0.2, 0.2)


@dataclass
class Lab:
    stand_in: StandIn
    device: MyRio


def call(*arguments: str, typed: str = "") -> Result:
    return CliRunner().invoke(devices, list(arguments), input=typed)


def refusal(*arguments: str, typed: str = "") -> str:
    """The one line with which a call ends."""
    result = call(*arguments, typed=typed)
    assert isinstance(result.exception, RigError), result.output
    assert "\n" not in str(result.exception)
    return str(result.exception)
