"""A myRIO that touches no device: this driver's calls and nifpga's own, on registers that are only numbers.

The loop rehearses its ticks on it (rig.realtime.rehearsal), so that what a tick runs through on real hardware, down to
nifpga's check of each status, is warm when the tick comes. The vendor's library itself is not called.
"""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Final

import nifpga
from nifpga.session import _Register  # nifpga makes registers for open sessions only, and this one has none
from nifpga.statuscheckedlibrary import FunctionInfo, StatusCheckedFunctions

from drivers.myrio.bitfile import load_bitfile
from drivers.myrio.channels import AngleChannel
from drivers.myrio.session import FpgaSession
from drivers.myrio.settings import MyRioSettings
from drivers.myrio.wiring import MyrioWiring, SessionChannels
from rig.interfaces import DeviceContext, Role

_COUNTS: Final = range(0, 4096, 8)
_EXCITATION_V: Final = 5.0


class _StillRegister:
    """What stands in one register, with nifpga's two functions on it."""

    def __init__(self) -> None:
        self.counts = 0

    def read(self, _session: int, _resource: int, data: Any) -> int:
        """As NiFpga_Read...; status 0 is success."""
        data.value = self.counts
        return 0

    def write(self, _session: int, _resource: int, _data: int) -> int:
        """As NiFpga_Write...; goes nowhere."""
        return 0

    def checked(self) -> StatusCheckedFunctions:
        """Both behind nifpga's check of the status, as those of its library."""
        named = ["session", "resource", "value"]
        return StatusCheckedFunctions(
            [FunctionInfo(self.read, "Read", named), FunctionInfo(self.write, "Write", named)]
        )


class StillSession(FpgaSession):
    """A session with nobody: the bitfile's registers, of nifpga's own class."""

    def __init__(self, settings: MyRioSettings, bitfile: nifpga.Bitfile) -> None:
        self.resource, self.state_found = settings.resource, "Running"
        self._bitfile, self._path = bitfile, settings.bitfile
        self.still = {name: _StillRegister() for name, one in bitfile.registers.items() if not one.is_array()}
        made = {name: _made(bitfile.registers[name], one.checked()) for name, one in self.still.items()}
        self._session = SimpleNamespace(registers=made, fpga_vi_state=nifpga.FpgaViState.Running)

    def settle(self, register: str, miss: Callable[[], float]) -> None:
        """Let the register show the counts with the least `miss`."""
        one = self.still[register]

        def missed(counts: int) -> float:
            one.counts = counts
            found = miss()
            return found if found == found else float("inf")

        one.counts = min(_COUNTS, key=missed)

    def close(self) -> None:
        """Nothing to let go."""


def _made(described: Any, functions: StatusCheckedFunctions) -> Any:
    return _Register(0, None, described, 0, functions["Read"], functions["Write"])


def still_channels(settings: MyRioSettings, context: DeviceContext, wiring: MyrioWiring) -> SessionChannels:
    """The channels of a rig at rest for ever: the monitors at the safe pressures, the joint at 0 degrees."""
    session = StillSession(settings, load_bitfile(settings.bitfile, context.where))
    channels = wiring.find(session)
    for role, monitor, safe_mpa in (
        (Role.MONITOR_1, channels.monitor_1, context.safe_p1_mpa),
        (Role.MONITOR_2, channels.monitor_2, context.safe_p2_mpa),
    ):
        if monitor is not None:
            take = monitor.take
            line = wiring.lines[role][0]
            session.settle(line.register, lambda take=take, safe_mpa=safe_mpa: abs(take()[1] - safe_mpa))  # type: ignore[misc]
    if channels.angle is not None:
        _settle_angle(session, settings, channels.angle)
    return channels


def _settle_angle(session: StillSession, settings: MyRioSettings, angle: AngleChannel) -> None:
    if settings.angle.excitation:
        session.settle(settings.angle.excitation, lambda: abs(angle.take()[1] - _EXCITATION_V))
    session.settle(settings.angle.wiper, lambda: abs(angle.take()[2]))
