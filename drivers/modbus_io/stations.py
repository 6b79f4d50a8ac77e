"""The one or two modules of a device as open lines: connect, prove, arm; shared by the direct device and by its I/O
process."""

from collections.abc import Callable, Mapping
from typing import Any, Final

from drivers.modbus_io import failsafe
from drivers.modbus_io.codec import to_counts
from drivers.modbus_io.plan import ExchangePlan
from drivers.modbus_io.session import DEVICE_FAILURE, ModbusSession, ModuleRefusal, connect_tcp
from drivers.modbus_io.settings import ModbusSettings
from rig.errors import DeviceError, DeviceLost, WatchdogTripped

Numbers = dict[int, float]
SAME_OUTPUT: Final = 0.001
"""Of the range of an output: 0.5 kPa of 0.5 MPa."""
_DISARMINGS: Final = 3
"""Attempts to stop the watchdog at the end: one exchange in a hundred may be lost on a bad line, not three in a row."""


class Stations:
    """Sessions of the output and the input module; on RTU, and for a module that is both, they are the same one."""

    def __init__(self, outputs: ModbusSession, inputs: ModbusSession, plan: ExchangePlan) -> None:
        self.outputs, self.inputs, self.plan = outputs, inputs, plan
        self.armed = False
        """The fail-safe has been armed by these, or is just being armed."""

    @classmethod
    def on_tcp(cls, settings: ModbusSettings, plan: ExchangePlan, reply_s: float) -> "Stations":
        """Connect to both modules."""
        connect_s = settings.connect_s
        outputs = connect_tcp(settings.host, settings.port, connect_s, reply_s)
        if plan.one_station or not (settings.input_host or settings.input_port):
            return cls(outputs, outputs, plan)
        try:
            port = settings.input_port or settings.port
            inputs = connect_tcp(settings.input_host or settings.host, port, connect_s, reply_s)
        except BaseException:
            outputs.close()
            raise
        return cls(outputs, inputs, plan)

    @classmethod
    def to_outputs(cls, settings: ModbusSettings, plan: ExchangePlan, reply_s: float, connect_s: float) -> "Stations":
        """Connect to the output module alone, to make it safe or to look at it: an input module may be gone."""
        outputs = connect_tcp(settings.host, settings.port, connect_s, reply_s)
        return cls(outputs, outputs, plan)

    def prove_outputs(self) -> dict[str, str]:
        """Check that the module with the outputs is that of its map."""
        plan = self.plan
        if not (plan.writes or plan.one_station):
            return {}
        return {"module": failsafe.identify(self.outputs, plan.module, plan.unit)}

    def prove(self) -> dict[str, str]:
        """Check that the modules are those of the maps."""
        plan, facts = self.plan, self.prove_outputs()
        if not plan.one_station and plan.registers:
            facts["input_module"] = failsafe.identify(self.inputs, plan.input_module, plan.input_unit)
        return facts

    def arm(self, watchdog_s: float, safe_numbers: Mapping[int, float]) -> Mapping[str, str]:
        """Arm the output module's fail-safe, where it has one. Outputs stay. Numbers are counts by place."""
        if not self.plan.writes or self.plan.looking:
            return {}
        self.armed = True
        by_channel = {channel: safe_numbers[place] for place, channel in self.plan.driven.items()}
        return failsafe.arm(self.outputs, self.plan.module, self.plan.unit, watchdog_s, by_channel)

    def prove_and_arm(self, watchdog_s: float, safe_numbers: Mapping[int, float]) -> dict[str, str]:
        """Both, and one reading: the map's inputs are there. A fail-safe that has tripped may refuse it until it is
        armed anew."""
        facts = self.prove() | self._how_far_it_tells()
        try:
            self._try_inputs()
        except DeviceError as error:
            if self.plan.module.failsafe is None or self.plan.looking:
                raise self._perhaps_tripped(error) from None
            facts |= self.arm(watchdog_s, safe_numbers)
            self._try_inputs()
            return facts
        return {**facts, **self.arm(watchdog_s, safe_numbers)}

    def _perhaps_tripped(self, error: DeviceError) -> DeviceError:
        """What a module with a fail-safe of its own, on which our valves are, refuses for."""
        failure = isinstance(error, ModuleRefusal) and error.code == DEVICE_FAILURE
        return WatchdogTripped(str(error)) if failure and self.plan.module.failsafe and self.plan.driven else error

    def _how_far_it_tells(self) -> dict[str, str]:
        """Of its outputs, for whoever arms."""
        if not self.plan.writes or self.plan.looking:
            return {}
        if self.plan.module.read_back is None:
            return {"read_back": "none: a safe state is written, and never confirmed"}
        return {"read_back": "outputs are read back; a gateway that answers with what was written to it cannot be told"}

    def _try_inputs(self) -> None:
        if self.plan.registers:
            self.read()

    def read(self) -> Numbers:
        """Place -> counts of each wanted input."""
        return self.plan.read(self.inputs)

    def write(self, numbers: Numbers) -> None:
        """The outputs, in counts by place."""
        self.plan.write(self.outputs, _listed(numbers))

    def read_write(self, numbers: Numbers) -> Numbers:
        """Both, in one exchange."""
        return self.plan.read_write(self.outputs, _listed(numbers))

    def feed(self, standing: Numbers | None) -> None:
        """Ask the output module for something, so that its watchdog knows of us; a module that can be asked nothing is
        given what stands at its outputs once more."""
        module = self.plan.module
        if module.read_back is not None:
            self.plan.read_back(self.outputs)
        elif module.identity is not None:
            failsafe.identify(self.outputs, module, self.plan.unit)
        elif standing is not None:
            self.write(standing)

    def write_safe(self, numbers: Numbers, watchdog_s: float) -> None:
        """The safe outputs, past a fail-safe that has tripped and refuses writes until it is armed anew, and past one
        output that is refused for the other's sake or its own. Not past a module that does not answer, which would be
        waited for once more: the loop calls, and calls again."""
        try:
            self.write(numbers)
        except DeviceError:
            if self.outputs.doubtful:
                raise
            if self.plan.module.failsafe is not None:
                self._arm_as_far_as_it_goes(watchdog_s, numbers)
            self.plan.write(self.outputs, _listed(numbers), apart=True)

    def _arm_as_far_as_it_goes(self, watchdog_s: float, numbers: Numbers) -> None:
        """A module that refuses a step of it, as for an output that is broken, is written to all the same."""
        try:
            self.arm(watchdog_s, numbers)
        except DeviceError:
            if self.outputs.doubtful:
                raise

    def hold(self, numbers: Numbers) -> bool | None:
        """Whether these numbers stand at the outputs, within what a converter's unused bits may swallow; None: it
        cannot tell."""
        found = self.plan.read_back(self.outputs)
        if found is None:
            return None
        low, high = self.plan.outputs.counts
        return all(abs(found[place] - numbers[place]) <= SAME_OUTPUT * (high - low) for place in self.plan.driven)

    def close(self, disarm: bool = True, get_ready: Callable[[], None] = lambda: None) -> None:
        """Let go; outputs stay, hence a watchdog that would change them is stopped first, unless they are not to
        stay. `get_ready` is called before each attempt."""
        if disarm and self.plan.writes and not self.plan.looking:
            self._disarm(get_ready)
        self.outputs.close()
        self.inputs.close()

    def _disarm(self, get_ready: Callable[[], None]) -> None:
        """Asked for again where a request, or its reply, was lost: nobody comes after this."""
        for _ in range(_DISARMINGS):
            try:
                get_ready()
                failsafe.disarm(self.outputs, self.plan.module.failsafe, self.plan.unit)
            except DeviceLost:
                return
            except DeviceError:
                continue
            return


def _listed(numbers: Numbers) -> list[float]:
    return [numbers.get(place, 0.0) for place in (0, 1)]


def set_point_numbers(
    plan: ExchangePlan, signals: Mapping[int, Callable[[float], float]], pressures_mpa: tuple[float, float]
) -> Numbers:
    """Counts of each driven set-point, clamped into what the block can give."""
    low, high = plan.outputs.counts
    return {
        place: min(max(to_counts(plan.outputs, signals[place](pressures_mpa[place])), low), high)
        for place in plan.driven
    }


def rebuild(settings: Any) -> ModbusSettings:
    """Settings that travelled as JSON."""
    from rig.config import structure

    return structure(settings, ModbusSettings, "modbus_io")
