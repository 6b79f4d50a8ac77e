"""Which registers of which unit a tick reads and writes, worked out once from the settings, the maps and the wanted
roles."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from drivers.modbus_io.codec import decode, encode, rtu_exchange_s
from drivers.modbus_io.maps import ChannelRun, ModuleMap, SafeIs
from drivers.modbus_io.session import ModbusSession
from drivers.modbus_io.settings import ModbusSettings, SerialLine
from rig.errors import ConfigError, DeviceError, DeviceLost
from rig.interfaces import Role

VALVES: Final = (Role.VALVE_1, Role.VALVE_2)
MONITORS: Final = (Role.MONITOR_1, Role.MONITOR_2)
"""In the order of their places in the list of input numbers."""
WIPER: Final = 2
EXCITATION: Final = 3
"""Places in the list of input numbers: monitor 1, monitor 2, wiper, excitation; then the further channels in the order
of the settings."""
FIRST_FURTHER: Final = 4
"""The place of the first further channel."""
_INPUTS: Final = ("monitor_1", "monitor_2", "angle.wiper", "angle.excitation")
"""Places -> what they are called in the settings."""


@dataclass(frozen=True)
class Write:
    """One run of outputs that lie side by side: which set-points, at which register."""

    address: int
    places: tuple[int, ...]


@dataclass(frozen=True)
class ExchangePlan:
    """The exchanges of one tick."""

    module: ModuleMap
    input_module: ModuleMap
    unit: int
    input_unit: int
    driven: dict[int, int]
    """Of the set-points 0 and 1, those that this device writes -> the output channel of each."""
    writes: tuple[Write, ...]
    first_register: int
    registers: int
    """How many registers the inputs that are wanted span; 0: none is wanted."""
    picks: dict[int, int]
    """Place in the input numbers -> channel after the first one read."""
    one_station: bool
    """Inputs and outputs belong to the same module."""
    looking: bool = False
    """The fail-safe is somebody else's: it is neither armed nor stopped."""

    @property
    def outputs(self) -> ChannelRun:
        """The output block; only asked for when something is driven."""
        assert self.module.outputs is not None
        return self.module.outputs

    @property
    def inputs(self) -> ChannelRun:
        """The input block; only asked for when something is read."""
        assert self.input_module.inputs is not None
        return self.input_module.inputs

    @property
    def can_combine(self) -> bool:
        """One exchange by function 23 does it all."""
        return self.module.read_write and self.one_station and len(self.writes) == 1 and self.registers > 0

    @property
    def must_feed(self) -> bool:
        """The module with the outputs has a watchdog, and reading the inputs, which are elsewhere, does not feed it."""
        fed = self.one_station and self.registers > 0
        return bool(self.writes) and self.module.failsafe is not None and not fed and not self.looking

    def encode(self, write: Write, numbers: Sequence[float]) -> list[int]:
        """The registers of one run of outputs."""
        return encode(self.outputs, [numbers[place] for place in write.places])

    def pick(self, registers: Sequence[int]) -> dict[int, float]:
        """Place -> number of each wanted input."""
        numbers = decode(self.inputs, registers)
        return {place: numbers[offset] for place, offset in self.picks.items()}

    def read(self, session: ModbusSession) -> dict[int, float]:
        """All wanted inputs in one exchange."""
        return self.pick(session.read(self.inputs.function, self.first_register, self.registers, self.input_unit))

    def write(self, session: ModbusSession, numbers: Sequence[float], *, apart: bool = False) -> None:
        """All outputs; side by side they change together unless they are to be written `apart`, otherwise one after the
        other. One that the module refuses keeps the other from nothing; a module that is silent is asked once."""
        refused: DeviceError | None = None
        for write in self._each() if apart else self.writes:
            try:
                session.write(write.address, self.encode(write, numbers), self.unit)
            except DeviceError as error:
                if session.doubtful or isinstance(error, DeviceLost):
                    raise
                refused = refused or error
        if refused is not None:
            raise refused

    def _each(self) -> list[Write]:
        width = self.outputs.type.registers
        return [
            Write(write.address + width * number, (place,))
            for write in self.writes
            for number, place in enumerate(write.places)
        ]

    def read_back(self, session: ModbusSession) -> dict[int, float] | None:
        """Place -> number that stands at each driven output by the module's own word; None when it cannot tell."""
        if self.module.read_back is None:
            return None
        back, width, found = self.module.read_back, self.outputs.type.registers, dict[int, float]()
        for write in self.writes:
            address = back.address + write.address - self.outputs.address
            registers = session.read(back.function, address, len(write.places) * width, self.unit)
            found |= dict(zip(write.places, decode(self.outputs, registers), strict=True))
        return found

    def read_write(self, session: ModbusSession, numbers: Sequence[float]) -> dict[int, float]:
        """Outputs and inputs in one exchange."""
        (write,) = self.writes
        registers = self.encode(write, numbers)
        return self.pick(session.read_write(self.first_register, self.registers, write.address, registers, self.unit))

    def round_s(self, line: SerialLine) -> float:
        """Wire time on RTU of one round of set-points and inputs. C: the module's own time comes on top."""

        def exchange(sent: int, answered: int) -> float:
            return rtu_exchange_s(line.baud, line.bits_per_byte, sent, answered)

        answer = 5 + 2 * self.registers
        if self.can_combine:
            return exchange(13 + 2 * len(self.writes[0].places) * self.outputs.type.registers, answer)
        total = exchange(8, answer) if self.registers else 0.0
        return total + sum(
            exchange(9 + 2 * len(write.places) * self.outputs.type.registers, 8) for write in self.writes
        )


def make_plan(
    settings: ModbusSettings, roles: frozenset[Role], *, looking: bool = False, where: str = "modbus_io"
) -> ExchangePlan:
    """ConfigError, one line that begins with `where` the settings stand, when a role is not wired, or wired to what the
    module does not have or to what another role is wired to."""
    module, input_module = settings.module, settings.input_module
    try:
        for role in sorted(roles):
            _check(role, settings, module, input_module)
        for name, one in settings.further.items():
            _check_input(f"further.{name}", one.channel, input_module)
        _check_apart(settings, roles, module)
        driven = {place: getattr(settings, role.value).channel for place, role in enumerate(VALVES) if role in roles}
        _check_fallback(driven, module)
    except ValueError as error:
        raise ConfigError(f"{where}: {error}") from None
    inputs = input_module.inputs
    channels = _input_channels(settings, roles)
    first = min(channels.values(), default=0)
    width = inputs.type.registers if inputs else 1
    one_station = settings.input_map is None
    unit = module.unit if settings.unit is None else settings.unit
    own_unit = input_module.unit if settings.input_unit is None else settings.input_unit
    return ExchangePlan(
        module,
        input_module,
        unit,
        unit if one_station else own_unit,
        driven,
        _runs(module, driven),
        (inputs.address if inputs else 0) + first * width,
        (max(channels.values()) - first + 1) * width if channels else 0,
        {place: channel - first for place, channel in channels.items()},
        one_station,
        looking,
    )


def _check(role: Role, settings: ModbusSettings, module: ModuleMap, input_module: ModuleMap) -> None:
    """ValueError for a role that is not wired, or to what is not there."""
    wired = getattr(settings, role.value)
    if wired is None:
        raise ValueError(f"{role.value} is wanted from {settings.resource}, but its channel is not set")
    if role is Role.ANGLE:
        _check_input("angle.wiper", wired.wiper, input_module)
        if wired.excitation is not None:
            _check_input("angle.excitation", wired.excitation, input_module)
        return
    output = role in VALVES
    owner = module if output else input_module
    if complaint := wired.complaint(owner.outputs if output else owner.inputs, output):
        raise ValueError(f"{role.value} on {owner.name}: {complaint}")


def _check_input(key: str, channel: int, module: ModuleMap) -> None:
    if module.inputs is None:
        raise ValueError(f"{key}: {module.name} has no inputs")
    if channel >= module.inputs.channels:
        raise ValueError(
            f"{key}: {module.name} has no input channel {channel}; allowed: 0 .. {module.inputs.channels - 1}"
        )


def _check_apart(settings: ModbusSettings, roles: frozenset[Role], module: ModuleMap) -> None:
    """ValueError for two that are wired to one channel: a line was copied and not changed."""
    outputs = {role.value: getattr(settings, role.value).channel for role in VALVES if role in roles}
    if len(outputs) > len(set(outputs.values())):
        raise ValueError(f"both valves on output channel {outputs[Role.VALVE_1]} of {module.name}: each needs its own")
    taken: dict[int, str] = {}
    for place, channel in _input_channels(settings, roles).items():
        if place >= FIRST_FURTHER:
            break  # what is looked at beside them may be the supply of one of them
        if channel in taken:
            raise ValueError(f"{taken[channel]} and {_INPUTS[place]} are both on input channel {channel}")
        taken[channel] = _INPUTS[place]


def _check_fallback(driven: Mapping[int, int], module: ModuleMap) -> None:
    """ValueError when the module's own fail-safe would take a valve to a value that nobody has set."""
    if module.failsafe is None or module.failsafe.safe_is is not SafeIs.REGISTERS:
        return
    known = {step.safe_channel for step in module.failsafe.arm}
    for place, channel in driven.items():
        if channel not in known:
            raise ValueError(
                f"{VALVES[place].value} on output channel {channel} of {module.name}: failsafe.arm of its "
                f"map has no step with safe_channel: {channel}, so its fail-safe would set whatever stands there"
            )


def _input_channels(settings: ModbusSettings, roles: frozenset[Role]) -> dict[int, int]:
    channels = {place: getattr(settings, role.value).channel for place, role in enumerate(MONITORS) if role in roles}
    if Role.ANGLE in roles and settings.angle:
        channels[WIPER] = settings.angle.wiper
        if settings.angle.excitation is not None:
            channels[EXCITATION] = settings.angle.excitation
    return channels | {place: one.channel for place, one in enumerate(settings.further.values(), FIRST_FURTHER)}


def _runs(module: ModuleMap, driven: Mapping[int, int]) -> tuple[Write, ...]:
    """Outputs side by side go in one write; a gap belongs to somebody else and is never written."""
    if not driven:
        return ()
    assert module.outputs is not None
    block = module.outputs
    at = sorted((channel, place) for place, channel in driven.items())

    def run(*members: tuple[int, int]) -> Write:
        return Write(block.address + members[0][0] * block.type.registers, tuple(place for _, place in members))

    side_by_side = len(at) == 2 and at[1][0] == at[0][0] + 1
    return (run(*at),) if side_by_side or len(at) == 1 else tuple(run(member) for member in at)
