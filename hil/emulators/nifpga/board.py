"""The myRIO's terminals and what is wired to them: regulators, monitors, potentiometer, with the world's plant behind.

Volts and counts here are those of the hardware, worked out apart from the driver's own conversion, so that an error in
one does not hide in the other.
"""

import math
from dataclasses import dataclass

from hil.emulators.nifpga.library import AFTER_STROBE, AFTER_WRITE, DELAY_US
from hil.emulators.nifpga.shared import HOOK_READ, HOOK_WRITE, READ, WRITE, RegisterFile
from hil.emulators.world import Outputs, World

HARDWARE_FAULT = -63150
"""NiFpga_Status_HardwareFault of NiFpga.h: a board that answers nothing any more."""


@dataclass(frozen=True)
class Line:
    """A pressure on a wire: `low_v` stands for `low_mpa`, `high_v` for `high_mpa`."""

    register: str
    low_v: float
    high_v: float
    low_mpa: float = 0.0
    high_mpa: float = 0.5

    def volts(self, pressure_mpa: float) -> float:
        """What the sender puts on the wire."""
        share = (pressure_mpa - self.low_mpa) / (self.high_mpa - self.low_mpa)
        return self.low_v + share * (self.high_v - self.low_v)

    def pressure_mpa(self, volts: float) -> float:
        """What the receiver understands; a regulator does not go below its range nor above it."""
        share = (volts - self.low_v) / (self.high_v - self.low_v)
        return self.low_mpa + min(max(share, 0.0), 1.0) * (self.high_mpa - self.low_mpa)


@dataclass(frozen=True)
class BoardWiring:
    """The paper's rig on connector A: 0-5 V to the regulators, 1-5 V back, a WDD35D8 with its excitation read as
    well."""

    valves: tuple[Line, Line] = (Line("AO.A_0.VAL", 0.0, 5.0), Line("AO.A_1.VAL", 0.0, 5.0))
    monitors: tuple[Line, Line] = (Line("AI.A_0.VAL", 1.0, 5.0), Line("AI.A_1.VAL", 1.0, 5.0))
    wiper: str = "AI.A_2.VAL"
    excitation: str = "AI.A_3.VAL"
    excitation_v: float = 4.95
    travel_deg: float = 345.0
    pot_ohm: float = 5000.0
    load_ohm: float = 500_000.0


class Board:
    """Answers the library's hook: terminals from the plant before a read, plant from the terminals after a strobe."""

    def __init__(self, registers: RegisterFile, world: World, wiring: BoardWiring | None) -> None:
        self.registers = registers
        self.world = world
        self.wiring = wiring or BoardWiring()
        self.failure: Exception | None = None
        """What went wrong in the plant: nothing can be raised through the C library."""
        self._cut: frozenset[str] = frozenset()
        self._swapped = False
        self._beat_ns: int | None = None
        self._shown: Outputs | None = None
        self._pins: tuple[int, ...] = ()
        self._valves = [(n, line) for n, line in enumerate(self.wiring.valves, 1) if line.register in registers]
        monitors = [line.register for line in self.wiring.monitors]
        for name in (*monitors, self.wiring.wiper, self.wiring.excitation, "RIG.TRIPPED", "RIG.HEARTBEAT"):
            if name in registers:
                registers.mark(name, HOOK_WRITE if name == "RIG.HEARTBEAT" else HOOK_READ)
        self._measure()
        if "SYS.RDY" in registers:
            registers.measure("SYS.RDY", 1)

    def leave_outputs_at(self, p1_mpa: float, p2_mpa: float) -> None:
        """The terminals as an earlier session left them."""
        for valve, line in self._valves:
            volts = line.volts(p1_mpa if valve == 1 else p2_mpa)
            self.registers.drive(line.register, counts_of(line.register, volts))
        self._follow()

    def cut(self, *wires: str) -> None:
        """Cut monitor_1, monitor_2, wiper or excitation: the input then reads 0 V. Without arguments: mend all."""
        self._cut = frozenset(wires)
        self._shown = None
        self._measure()

    def swap_valves(self) -> None:
        """Exchange the regulators' input wires."""
        self._swapped = True
        self._pins = ()

    def poll(self) -> None:
        """Bring terminals and plant up to date; for a board that runs beside the process that holds the session."""
        self._follow()
        self._measure()

    def hook(self, event: int, argument: int) -> None:
        """For library.Library.set_hook."""
        try:
            self._handle(event, argument)
        except Exception as error:  # noqa: BLE001 - nothing may be raised into C; the session then fails like broken hardware
            self.failure = error
            self.registers.fail(HARDWARE_FAULT, READ | WRITE)

    def commands_mpa(self) -> tuple[float, float]:
        """What the regulators are told now, watchdog and limits included."""
        self._follow()
        return self.world.commands

    def _handle(self, event: int, argument: int) -> None:
        clock = self.world.clock
        if event == DELAY_US:
            clock.wait_until_ns(clock.now_ns() + 1000 * argument)
            return
        if event == AFTER_WRITE:
            self._beat_ns = clock.now_ns()
        if event == AFTER_STROBE:
            self._limit()
        self.poll()

    def _limit(self) -> None:
        for _, line in self._valves:
            low, high = f"RIG.LIMIT.{line.register[:-4]}.MIN", f"RIG.LIMIT.{line.register[:-4]}.MAX"
            if low in self.registers and self.registers.value(high):
                pin = self.registers.pin(line.register)
                self.registers.drive(
                    line.register, min(max(pin, self.registers.value(low)), self.registers.value(high))
                )

    def _follow(self) -> None:
        self._watch()
        pins = tuple(self.registers.pin(line.register) for _, line in self._valves)
        if pins == self._pins:
            return
        self._pins = pins
        for (valve, line), pin in zip(self._valves, pins, strict=True):
            pressure_mpa = line.pressure_mpa(output_volts(line.register, pin))
            self.world.command(3 - valve if self._swapped else valve, pressure_mpa)

    def _watch(self) -> None:
        """The FPGA's watchdog: armed by the first heartbeat, safe counts when the beats stop."""
        if self._beat_ns is None or "RIG.WATCHDOG_MS" not in self.registers:
            return
        limit_ns = self.registers.value("RIG.WATCHDOG_MS") * 1_000_000
        if limit_ns and self.world.clock.now_ns() - self._beat_ns > limit_ns:
            self.registers.measure("RIG.TRIPPED", 1)
            for _, line in self._valves:
                self.registers.drive(line.register, self.registers.value(f"RIG.SAFE.{line.register[:-4]}"))

    def _measure(self) -> None:
        now = self.world.outputs()
        if now is self._shown:
            return
        self._shown = now
        wiring, cut = self.wiring, self._cut
        for name, line, pressure in zip(
            ("monitor_1", "monitor_2"), wiring.monitors, (now.p1_mpa, now.p2_mpa), strict=True
        ):
            self._put(line.register, 0.0 if name in cut else line.volts(pressure))
        excitation = 0.0 if "excitation" in cut else wiring.excitation_v
        self._put(wiring.excitation, excitation)
        self._put(wiring.wiper, 0.0 if "wiper" in cut else excitation * self._wiper_share(now.angle_deg))

    def _wiper_share(self, angle_deg: float) -> float:
        """Voltage divider under load; off the track the wiper hangs free and its input pulls it to 0 V."""
        wiring = self.wiring
        turned = angle_deg / wiring.travel_deg + 0.5
        if not 0.0 <= turned <= 1.0 or math.isnan(turned):
            return 0.0
        upper = (1.0 - turned) * wiring.pot_ohm
        lower = 1.0 / (1.0 / max(turned * wiring.pot_ohm, 1e-9) + 1.0 / wiring.load_ohm)
        return lower / (upper + lower)

    def _put(self, register: str, volts: float) -> None:
        if register in self.registers:
            self.registers.measure(register, counts_of(register, volts))


def counts_of(register: str, volts: float) -> int:
    """A terminal's voltage, in or out, as the 16 bits of its register; the converters have 12."""
    if ".C_" in register:
        return min(max(round(volts / 20.0 * 4096), -2048), 2047) & 0xFFFF
    return min(max(round(volts / 5.0 * 4096), 0), 4095)


def output_volts(register: str, bits: int) -> float:
    """What a terminal carries for the bits in its register."""
    if ".C_" in register:
        signed = bits - 0x10000 if bits & 0x8000 else bits
        return min(max(signed, -2048), 2047) * 20.0 / 4096
    return min(bits, 4095) * 5.0 / 4096
