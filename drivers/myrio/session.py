"""One FPGA session of nifpga: opened, running, ready, its registers found by name, and its errors in one line each."""

import functools
import warnings
from collections.abc import Callable
from typing import Any, Final

import nifpga
import nifpga.session
from nifpga.statuscheckedlibrary import LibraryNotFoundError

from drivers.myrio.settings import MyRioSettings
from rig.config import suggest
from rig.errors import ConfigError, DeviceError, DeviceLost
from rig.interfaces import Clock

VENDOR_ERRORS: Final = (nifpga.ErrorStatus, nifpga.WarningStatus)
"""What a call into nifpga may raise; warnings too, where a filter turns them into errors."""

_TRANSIENT: Final = {-50400, -52007, -61046}
"""FifoTimeout, OperationTimedOut, CommunicationTimeout: the next call may work."""

_HINTS: Final = {
    -52006: "no such resource; is the name right, and NI-RIO running?",
    -61141: "another program holds the FPGA; close LabVIEW or the other session",
    -61202: "another program holds the FPGA; close LabVIEW or the other session",
    -63040: "no connection to the myRIO; is it on, and the host name right?",
    -63042: "the network to the myRIO failed",
    -63043: "the remote session is lost",
    -63044: "no NI-RIO server on that host",
    -63101: "the bitfile cannot be read",
    -63106: "the bitfile is not the one that was compiled for this interface; give the .lvbitx that runs on the FPGA",
    -63107: "the bitfile was made for another target",
    -63150: "hardware fault",
    -63170: "power shutdown",
    -63192: "no such resource; RIO0 on the controller, rio://HOST/RIO0 from a host",
    -63195: "the session is lost; the myRIO was restarted or reset",
}

vendor_library: Final = functools.cache(nifpga.session._NiFpga)  # noqa: SLF001  # it offers no other way
"""nifpga looks for its library at each opening, by programs that it starts (ldconfig, a compiler). Starting one takes
the interpreter from a loop that opens a session for the safe state, until that program has got a processor. Once found,
it is kept."""
nifpga.session._NiFpga = vendor_library  # noqa: SLF001


def explain(error: Any, resource: str, doing: str) -> DeviceError:
    """nifpga's error as one of ours: what failed, on which resource, with which status, and what that means."""
    code = error.get_code()
    hint = _HINTS.get(code, "")
    line = f"myRIO {resource}: {doing} failed: {error.get_code_string()} ({code}){': ' + hint if hint else ''}"
    return DeviceError(line) if code in _TRANSIENT else DeviceLost(line)


class FpgaSession:
    """An open session, with the FPGA running and ready."""

    def __init__(self, settings: MyRioSettings, clock: Clock, bitfile: nifpga.Bitfile) -> None:
        """Opens, runs if it does not run yet, and waits until ready; the outputs of a running FPGA do not change."""
        self.resource = settings.resource
        self._bitfile = bitfile
        self._path = settings.bitfile
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # positive statuses, such as FpgaAlreadyRunning
                self._session = nifpga.Session(bitfile, settings.resource, no_run=True)
                try:
                    self.state_found = self._run()
                    self._await_ready(settings, clock)
                except BaseException:
                    self.close()
                    raise
        except LibraryNotFoundError:
            raise DeviceLost("libNiFpga.so is not installed: install NI-RIO, or run on the myRIO itself") from None
        except OSError as error:  # made for another machine, cut short, or without what it needs itself
            raise DeviceLost(f"libNiFpga.so cannot be loaded: {error}; install NI-RIO anew") from None
        except ValueError as error:
            raise DeviceLost(f"myRIO {self.resource}: opening failed: the library answers nonsense: {error}") from None
        except VENDOR_ERRORS as error:
            raise explain(error, self.resource, "opening") from None

    @property
    def signature(self) -> str:
        """The bitfile's signature, which the FPGA confirmed."""
        return str(self._bitfile.signature)

    @property
    def runs(self) -> bool:
        """Whether the VI runs on the FPGA: of one that was stopped the registers still take and tell what is written
        to them, and its terminals keep what they carried."""
        try:
            return self._session.fpga_vi_state is nifpga.FpgaViState.Running
        except ValueError:  # a state that there is not
            return False

    def has(self, register: str) -> bool:
        """Whether the bitfile has a register of that name."""
        return register in self._session.registers

    def datatype(self, register: str) -> str:
        """Data type of a register, such as U16."""
        return str(self._find(register).datatype)

    def reader(self, register: str) -> Callable[[], int]:
        """The call that reads a register."""
        read: Callable[[], int] = self._find(register).read
        return read

    def writer(self, register: str) -> Callable[[int], None]:
        """The call that writes a register."""
        write: Callable[[int], None] = self._find(register).write
        return write

    def close(self) -> None:
        """Let go; the FPGA runs on and its outputs stay."""
        try:
            self._session.close(reset_if_last_session=False)
        except VENDOR_ERRORS:
            return  # a lost session needs no closing

    def _find(self, register: str) -> Any:
        registers = self._session.registers
        if register not in registers:
            raise ConfigError(
                f"{self._path}: the bitfile has no register {register!r}; {_nearest(register, registers)}"
            )
        return registers[register]

    def _run(self) -> str:
        """Start the VI unless it runs; one that stopped by an error or by itself is reset first."""
        found = self._session.fpga_vi_state
        if found in (nifpga.FpgaViState.Invalid, nifpga.FpgaViState.NaturallyStopped):
            self._session.reset()
        if found is not nifpga.FpgaViState.Running:
            self._session.run()
        return str(found.name)

    def _await_ready(self, settings: MyRioSettings, clock: Clock) -> None:
        if not settings.ready:
            return
        read = self.reader(settings.ready)
        deadline_ns = clock.now_ns() + int(settings.ready_timeout_s * 1e9)
        while not read():
            if clock.now_ns() >= deadline_ns:
                raise DeviceLost(
                    f"myRIO {self.resource}: {settings.ready} did not come within {settings.ready_timeout_s:g} s"
                )
            clock.wait_until_ns(clock.now_ns() + 1_000_000)


def _nearest(name: str, known: Any) -> str:
    if len(known) <= 8:
        return suggest(name, list(known))
    near = suggest(name, list(known))
    return near if near.startswith("did") else f"it has {len(known)} others, is it the right one?"
