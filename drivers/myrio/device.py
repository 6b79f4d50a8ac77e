"""NI myRIO-1900 as a device of the rig: two set-points, two monitors and the potentiometer through one FPGA session."""

import contextlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from drivers.myrio.bitfile import KeptBitfile
from drivers.myrio.rescue import Rescue
from drivers.myrio.session import VENDOR_ERRORS, FpgaSession, explain
from drivers.myrio.settings import MyRioSettings
from drivers.myrio.wiring import MyrioWiring, SessionChannels
from rig.errors import DeviceError, DeviceLost
from rig.interfaces import NAN, Abilities, Clock, Device, DeviceContext, Measurement, Role
from rig.sample import ABSENT_BY_ROLE, ANGLE_ABSENT, P1_ABSENT, P2_ABSENT

PROBE_CALLS: Final = 200
"""Calls of which `probe` tells the median and the 99th percentile."""
RESCUE_SHARE: Final = 0.3
"""Of a period: how long `safe` waits for a new session before it says: not yet."""
RESCUE_PATIENCE_S: Final = 3.0
"""For the thread that opens a new session, when the device is closed, s."""
UNFED_PERIODS: Final = 3
"""Since the last heartbeat for the FPGA's watchdog: who ticks feeds it in each."""


class MyRio(Abilities):
    """NI myRIO-1900 through nifpga, local or over the network.

    `open` lets a running FPGA run on, so its outputs stay; an FPGA that did not run is started and its outputs are then
    those of the VI's defaults (0 V). `close` leaves the outputs at their last values. A second instance in another
    process is a second session on the same FPGA and may call `safe` at any time; open it beforehand, opening takes 0.1
    s and more.
    """

    Settings = MyRioSettings
    second_path = True
    """Another process may open a session of its own and call `safe`."""

    def __init__(self, settings: MyRioSettings, context: DeviceContext) -> None:
        self.roles = context.roles
        self._settings, self._context = settings, context
        self.further = tuple(settings.further)
        self._clock, self._now = context.clock, context.clock.now_ns
        self._period_ns = context.period_ns
        self._wiring = MyrioWiring(settings, context)
        self._bitfile = KeptBitfile(settings.bitfile, context.where)
        self._absent = sum(flag for role, flag in ABSENT_BY_ROLE.items() if role not in self.roles)
        self._open: SessionChannels | None = None
        self._rescue: Rescue | None = None
        """Once the device has been open: somebody ticks, and `safe` must not make him wait for a new session."""
        self._beat = 0
        self._fed_ns = -(1 << 62)
        self._held: bool | None = None
        """What a session that was opened for the safe state has read back, until somebody asks."""

    def open(self) -> Mapping[str, str]:
        """Open the session, find every register, wait until ready; a remote one is refused when it is too slow.

        Raises ConfigError for a wrong bitfile or a missing register, DeviceLost when there is no session to be had.
        """
        self.close()
        self._bitfile.forget()
        channels = self._connect()
        session = channels.session
        facts = {
            "device": f"myRIO {session.resource}",
            "bitfile": self._settings.bitfile.name,
            "signature": session.signature,
            "fpga_found": session.state_found,
            "heartbeat": self._settings.heartbeat or "none in this bitfile: no watchdog in the FPGA",
        }
        if self._settings.heartbeat:
            facts["watchdog_s"] = f"{self._settings.watchdog_s:g}" if self._settings.watchdog_s else "unknown"
        if self._settings.is_remote:
            facts |= self._check_remote(channels)
        self._open = channels
        self._rescue = Rescue(facts["device"], self._safe_by_new_session)
        return facts

    def read(self) -> Measurement:
        """Both monitors, wiper and excitation; raw values are volts (or mA, by units_per_volt).

        Every age is the time since just before the first of them was read: the FPGA converts each terminal within 10
        us.
        """
        channels = self._channels()
        now = self._now
        flags: int = self._absent
        others = (NAN, NAN, NAN, NAN)
        p1_raw = p1_mpa = p2_raw = p2_mpa = angle_raw = excitation = angle_deg = NAN
        began = now()
        try:
            self._feed(channels)
            if channels.monitor_1:
                p1_raw, p1_mpa, flag = channels.monitor_1.take()
                flags |= flag
            if channels.monitor_2:
                p2_raw, p2_mpa, flag = channels.monitor_2.take()
                flags |= flag
            if channels.angle:
                angle_raw, excitation, angle_deg, flag = channels.angle.take()
                flags |= flag
            if channels.further:
                first, second, third, fourth = (one.take() if one else NAN for one in channels.further)
                others = (first, second, third, fourth)
        except VENDOR_ERRORS as error:
            raise self._failed(error, "reading") from None
        ended = now()
        age = ended - began
        if age > self._period_ns:
            raise self._late(began, ended, "reading")
        return Measurement(
            p1_mpa, p2_mpa, angle_deg, p1_raw, p2_raw, angle_raw, excitation,
            0 if flags & P1_ABSENT else age, 0 if flags & P2_ABSENT else age, 0 if flags & ANGLE_ABSENT else age,
            flags, *others,
        )  # fmt: skip

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """Stage both set-points and strobe once: the terminals change together."""
        channels = self._channels()
        began = self._now()
        self._put(channels, p1_cmd_mpa, p2_cmd_mpa)
        ended = self._now()
        if ended - began > self._period_ns:
            raise self._late(began, ended, "writing")

    def safe(self) -> None:
        """Write the safe set-points through the open session or, when that is lost or not there, through one opened for
        this.

        Once the device has been open, a new session is opened in the background, and DeviceError means: not yet, ask
        again.
        """
        if not self.roles & {Role.VALVE_1, Role.VALVE_2}:
            return
        if self._open is not None:
            try:
                self._put_safe(self._open)
                return
            except DeviceError as error:
                if isinstance(error, DeviceLost):
                    self._let_go()
        if self._rescue is None:
            self._safe_by_new_session()
        else:
            self._rescue.attempt(self._period_ns * RESCUE_SHARE / 1e9)

    def keep(self) -> None:
        """Raise the heartbeat alone, where there is one."""
        try:
            self._feed(self._channels())
        except VENDOR_ERRORS as error:
            raise self._failed(error, "keeping") from None

    def _feed(self, channels: SessionChannels) -> None:
        if channels.heartbeat:
            self._beat = (self._beat + 1) & 0x7FFF
            channels.heartbeat(self._beat)
            self._fed_ns = self._now()

    def _safe_by_new_session(self) -> None:
        channels = self._connect()
        try:
            self._put_safe(channels)
            with contextlib.suppress(DeviceError):
                self._held = self._holds_safe(channels)
        finally:
            channels.session.close()

    def _put_safe(self, channels: SessionChannels) -> None:
        """DeviceLost where the VI does not run: a new session starts it."""
        self._held = None
        self._put(channels, self._context.safe_p1_mpa, self._context.safe_p2_mpa)
        if not self._runs(channels):
            raise DeviceLost(
                f"myRIO {self._settings.resource}: the VI does not run: its outputs do not follow what is written"
            )

    def _runs(self, channels: SessionChannels) -> bool:
        try:
            return channels.session.runs
        except VENDOR_ERRORS as error:
            raise self._failed(error, "asking whether the VI runs") from None

    def holds_safe(self) -> bool | None:
        """Whether the FPGA runs and its output registers hold the safe set-points: what a new session has read after
        it wrote them is told once. None while a new session would have to be waited for, and where the FPGA's own
        watchdog is not fed from here, which takes the outputs to what it holds for safe."""
        if self._settings.heartbeat and self._now() - self._fed_ns > UNFED_PERIODS * self._period_ns:
            return None
        if self._open is not None:
            return self._holds_safe(self._open)
        if self._rescue is not None:
            held, self._held = self._held, None
            return held
        if not self.roles & {Role.VALVE_1, Role.VALVE_2}:
            return None
        channels = self._connect()
        try:
            return self._holds_safe(channels)
        finally:
            channels.session.close()

    def _holds_safe(self, channels: SessionChannels) -> bool:
        if not self._runs(channels):
            return False
        safe_mpa = self._context.safe_p1_mpa, self._context.safe_p2_mpa
        try:
            return all(
                output.standing() == output.bits(p)
                for output, p in zip(channels.outputs, safe_mpa, strict=True)
                if output
            )
        except VENDOR_ERRORS as error:
            raise self._failed(error, "reading back") from None

    def prepare_safe(self) -> None:
        """Hold a session open, so that `safe` is a matter of microseconds; for whoever may need it, the supervisor.
        Moves nothing."""
        self.open()

    def twin(self, clock: Clock) -> Device:
        """Another on `clock` that touches no device, for rehearsals."""
        return _StillMyRio(self._settings, replace(self._context, clock=clock))

    def close(self) -> None:
        """Close the session; the FPGA runs on and its outputs stay. A safe write that is under way is waited for."""
        if self._rescue is not None:
            self._rescue.finish(RESCUE_PATIENCE_S)
            self._rescue = None
        self._let_go()

    def _let_go(self) -> None:
        if self._open is not None:
            self._open.session.close()
            self._open = None

    def _channels(self) -> SessionChannels:
        if self._open is None:
            raise DeviceLost(f"myRIO {self._settings.resource}: the session is not open")
        return self._open

    def _connect(self) -> SessionChannels:
        with self._bitfile.at_hand() as bitfile:
            session = FpgaSession(self._settings, self._clock, bitfile)
        try:
            channels = self._wiring.find(session)
        except BaseException:
            session.close()
            raise
        return channels

    def _put(self, channels: SessionChannels, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        if channels.strobe is None:
            return
        first, second = channels.outputs
        try:
            bits_1 = first.bits(p1_cmd_mpa) if first else 0
            bits_2 = second.bits(p2_cmd_mpa) if second else 0
            if not channels.limited:
                self._limit(channels)
            if first:
                first.stage(bits_1)
            if second:
                second.stage(bits_2)
            channels.strobe(1)
        except ValueError as error:
            raise DeviceError(f"myRIO {self._settings.resource}: {error}; nothing was written") from None
        except VENDOR_ERRORS as error:
            raise self._failed(error, "writing") from None

    def _limit(self, channels: SessionChannels) -> None:
        """Give the FPGA its limits before the first output of a session, where the bitfile has registers for them."""
        for role, output in zip((Role.VALVE_1, Role.VALVE_2), channels.outputs, strict=True):
            line = self._wiring.lines[role][0]
            for register, counts in zip(
                (line.limit_min, line.limit_max), output.count_range if output else (), strict=False
            ):
                if register:
                    channels.session.writer(register)(counts)
        channels.limited = True

    def _failed(self, error: BaseException, doing: str) -> DeviceError:
        return explain(error, self._settings.resource, doing)

    def _late(self, began_ns: int, ended_ns: int, doing: str) -> DeviceError:
        took, period = (ended_ns - began_ns) / 1e6, self._period_ns / 1e6
        return DeviceError(
            f"myRIO {self._settings.resource}: {doing} took {took:.1f} ms, longer than the period of {period:g} ms"
        )

    def _check_remote(self, channels: SessionChannels) -> dict[str, str]:
        """Time single reads, the only call that moves nothing, and refuse when a tick of them does not fit."""
        read = channels.session.reader(self._settings.ready or self._settings.angle.wiper)
        times = []
        for _ in range(PROBE_CALLS):
            began = self._now()
            read()
            times.append((self._now() - began) * channels.calls)
        times.sort()
        p50, p99 = times[PROBE_CALLS // 2], times[PROBE_CALLS * 99 // 100]
        if p99 > self._settings.remote_share * self._period_ns:
            channels.session.close()
            raise DeviceLost(
                f"myRIO {self._settings.resource}: too slow for a period of {self._period_ns / 1e6:g} ms: the "
                f"{channels.calls} calls "
                f"of a tick take {p99 / 1e6:.1f} ms at p99; run the loop on the myRIO itself (resource RIO0)"
            )
        return {"remote_tick_p50_us": f"{p50 / 1e3:.0f}", "remote_tick_p99_us": f"{p99 / 1e3:.0f}"}


class _StillMyRio(MyRio):
    """At rest for ever: the monitors at the safe pressures, the joint at 0 degrees."""

    def open(self) -> Mapping[str, str]:
        """Registers as the settings name them; ConfigError as for a real one."""
        self._open = self._connect()
        return {}

    def _connect(self) -> SessionChannels:
        from drivers.myrio.twin import still_channels

        return still_channels(self._settings, self._context, self._wiring)
