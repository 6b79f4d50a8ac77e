"""Which registers of the FPGA serve which role: found by name in an open session, with calibrations and flags."""

from collections.abc import Callable
from dataclasses import dataclass

from drivers.calibration import Potentiometer, for_role, nominal
from drivers.myrio.channels import AngleChannel, FurtherInputChannel, PressureInput, PressureOutput
from drivers.myrio.session import FpgaSession
from drivers.myrio.settings import MyRioSettings
from rig.errors import ConfigError
from rig.interfaces import DeviceContext, Role
from rig.sample import ABSENT_BY_ROLE


@dataclass
class SessionChannels:
    """What an open session offers; None where the rig asked for no such role."""

    session: FpgaSession
    outputs: tuple[PressureOutput | None, PressureOutput | None]
    strobe: Callable[[int], None] | None
    monitor_1: PressureInput | None
    monitor_2: PressureInput | None
    angle: AngleChannel | None
    heartbeat: Callable[[int], None] | None
    calls: int
    """Calls into the FPGA of one tick."""
    further: tuple[FurtherInputChannel | None, ...] = ()
    """In the order of a sample's places."""
    limited: bool = False
    """The FPGA has been given its limits in this session."""


class MyrioWiring:
    """The settings of each role with its calibration, and where its registers are."""

    def __init__(self, settings: MyRioSettings, context: DeviceContext) -> None:
        self._settings, self._context = settings, context
        self.lines = {
            role: (getattr(settings, role.value), for_role(context, role, nominal(getattr(settings, role.value).span)))
            for role in (Role.VALVE_1, Role.VALVE_2, Role.MONITOR_1, Role.MONITOR_2)
        }
        """Role -> the settings of its line, and its calibration."""
        self._potentiometer = for_role(context, Role.ANGLE, Potentiometer())
        self._check_apart()

    def _check_apart(self) -> None:
        """ConfigError for two that are wired to one terminal: a line was copied and not changed."""
        roles = self._context.roles
        wired = {role.value: line.register for role, (line, _) in self.lines.items() if role in roles}
        if Role.ANGLE in roles:
            angle = self._settings.angle
            wired |= {"angle.wiper": angle.wiper} | ({"angle.excitation": angle.excitation} if angle.excitation else {})
        taken: dict[str, str] = {}
        for name, register in wired.items():
            if register in taken:
                where = self._context.where or "myrio"
                raise ConfigError(f"{where}: {taken[register]} and {name} are both on {register}: each needs its own")
            taken[register] = name

    def find(self, session: FpgaSession) -> SessionChannels:
        """Every register that the rig's roles need; ConfigError when the bitfile has none of that name."""
        settings, roles = self._settings, self._context.roles
        out = {
            role: PressureOutput(session, *self.lines[role]) for role in (Role.VALVE_1, Role.VALVE_2) if role in roles
        }
        monitors = {
            role: PressureInput(session, *self.lines[role], ABSENT_BY_ROLE[role])
            for role in (Role.MONITOR_1, Role.MONITOR_2)
            if role in roles
        }
        angle = AngleChannel(session, settings.angle, self._potentiometer) if Role.ANGLE in roles else None
        strobe = session.writer(settings.strobe) if out else None
        heartbeat = session.writer(settings.heartbeat) if settings.heartbeat else None
        wired = [settings.further.get(name) for name in self._context.places]
        further = tuple(FurtherInputChannel(session, one) if one else None for one in wired) if any(wired) else ()
        reads = len(monitors) + (0 if angle is None else 2 if settings.angle.excitation else 1) + len(settings.further)
        calls = reads + len(out) + bool(strobe) + bool(heartbeat)
        outputs = out.get(Role.VALVE_1), out.get(Role.VALVE_2)
        first, second = monitors.get(Role.MONITOR_1), monitors.get(Role.MONITOR_2)
        return SessionChannels(session, outputs, strobe, first, second, angle, heartbeat, calls, further)
