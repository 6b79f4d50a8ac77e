"""The edge to pymodbus: one client, one exchange a call, and every way in which that fails turned into our errors.

pymodbus does not raise for an exception reply, and after a time-out the late reply is still on its way: both are dealt
with here. Works with its synchronous clients and, given `wait`, with its asyncio ones.
"""

import struct
from collections.abc import Callable, Sequence
from typing import Any, Final

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ConnectionException, ModbusException
from pymodbus.logging import Log

from rig.errors import DeviceError, DeviceLost

_SILENT: Final = 100
"""Above every level of pymodbus's log: it would write each time-out to stderr; we raise it instead."""
_MOST_LEFT: Final = 4096
"""Bytes of late replies: a frame has 260."""
DEVICE_FAILURE: Final = 4
"""Exception code 4 of the Modbus protocol."""
_REASONS: Final = {
    1: "it does not know this function",
    2: "it has no such register: wrong map, or wrong module",
    3: "it refuses the value",
    DEVICE_FAILURE: "device failure; its watchdog may have tripped: close and open again",
    6: "it is busy",
    10: "gateway: no path to the unit",
    11: "gateway: no answer from the unit: is the unit id right?",
}


class ModuleRefusal(DeviceError):
    """A module's answer with an exception code."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.code = code


class ModbusSession:
    """Exchanges with the units behind one client."""

    def __init__(
        self,
        client: Any,
        where: str,
        wait: Callable[[Any], Any] = lambda response: response,
        get_ready: Callable[[], None] = lambda: None,
    ) -> None:
        """`get_ready` is called before each exchange."""
        self.client, self.where, self._wait, self._get_ready = client, where, wait, get_ready
        self.doubtful = False
        """The last exchange failed, so a late reply may still come."""

    def read(self, function: int, address: int, count: int, unit: int) -> list[int]:
        """`count` registers by function 3 or 4."""
        ask = self.client.read_input_registers if function == 4 else self.client.read_holding_registers
        response = self._exchange(
            lambda: ask(address, count=count, device_id=unit), f"reading {count} registers at {_shown(address)}"
        )
        return self._registers(response, function, count, address)

    def write(self, address: int, registers: Sequence[int], unit: int) -> None:
        """Consecutive registers by function 16."""
        what = f"writing {len(registers)} registers at {_shown(address)}"
        response = self._exchange(lambda: self.client.write_registers(address, list(registers), device_id=unit), what)
        if (response.function_code, response.address, response.count) != (16, address, len(registers)):
            self._fail(f"{what}: the reply belongs to another request")

    def read_write(self, read_address: int, count: int, address: int, registers: Sequence[int], unit: int) -> list[int]:
        """Write, then read `count` registers, in one exchange by function 23."""
        response = self._exchange(
            lambda: self.client.readwrite_registers(
                read_address=read_address,
                read_count=count,
                write_address=address,
                values=list(registers),
                device_id=unit,
            ),
            f"writing {len(registers)} registers at {_shown(address)} and reading {count} at {_shown(read_address)}",
        )
        return self._registers(response, 23, count, read_address)

    def _registers(self, response: Any, function: int, count: int, address: int) -> list[int]:
        if response.function_code != function or len(response.registers) != count:
            self._fail(
                f"{len(response.registers)} registers by function {response.function_code} "
                f"for {count} at {_shown(address)} by {function}"
            )
        registers: list[int] = response.registers
        return registers

    def _exchange(self, call: Callable[[], Any], what: str) -> Any:
        self._get_ready()
        if not self.client.connected:
            raise DeviceLost(
                f"{self.where}: not connected"
            )  # pymodbus would connect anew, for seconds, within the loop
        if self.doubtful:
            self._drain()
        try:
            response = self._wait(call())
        except ConnectionException:
            self.doubtful = True
            raise DeviceLost(f"{self.where}: {what}: the connection was closed") from None
        except (TimeoutError, ModbusException):
            self._fail(f"{what}: no usable answer in time")
        except (ValueError, IndexError, TypeError, KeyError, struct.error) as error:
            self._fail(f"{what}: garbled answer ({type(error).__name__})")
        except OSError as error:
            self.doubtful = True
            raise DeviceLost(f"{self.where}: {what}: {error.strerror or error}") from None
        self.doubtful = False
        if response.isError():
            code = getattr(response, "exception_code", 0)
            raise ModuleRefusal(f"{self.where}: {what}: exception {code}: {_REASONS.get(code, 'see the manual')}", code)
        return response

    def _fail(self, text: str) -> Any:
        self.doubtful = True
        if not self.client.connected:
            raise DeviceLost(f"{self.where}: {text}: the line is gone")
        raise DeviceError(f"{self.where}: {text}")

    def _drain(self) -> None:
        """Throw away what is left of a failed exchange. Half a frame would shift all that follow it. DeviceLost when
        there is more than late replies can be: who sends without being asked never comes to an end."""
        wire = getattr(self.client, "socket", None)
        if wire is None or not hasattr(wire, "recv"):
            return  # an asyncio client clears its own buffer
        wire.setblocking(False)
        try:
            left = wire.recv(_MOST_LEFT)
        except BlockingIOError:
            return
        except OSError:
            left = b""
        if 0 < len(left) < _MOST_LEFT:
            return
        self.client.close()
        raise DeviceLost(f"{self.where}: {'it sends without being asked' if left else 'the connection was closed'}")

    def close(self) -> None:
        """Let go of the line."""
        self.client.close()


def _shown(address: int) -> str:
    """Both ways in which manuals write an address."""
    return f"address {address} (0x{address:04x})"


def hush() -> None:
    """Keep pymodbus from writing to stderr; what it has to say comes as an error of ours."""
    Log.setLevel(_SILENT)  # type: ignore[no-untyped-call]


def connect_tcp(host: str, port: int, connect_s: float, reply_s: float) -> ModbusSession:
    """A connection to a module; DeviceLost when there is none within `connect_s`. Replies may take `reply_s`, twice
    that when in pieces."""
    hush()
    where = f"{host}:{port}"
    client = ModbusTcpClient(host, port=port, timeout=connect_s, retries=0)
    if not client.connect():  # type: ignore[no-untyped-call]
        raise DeviceLost(f"{where}: no connection within {connect_s:g} s: check address, port, cable and power")
    set_reply_time(client, reply_s)
    return ModbusSession(client, where)


def set_reply_time(client: ModbusTcpClient, reply_s: float) -> None:
    """pymodbus has one time-out for connecting and replying, copied into its transaction manager: set both copies."""
    client.comm_params.timeout_connect = client.transaction.comm_params.timeout_connect = reply_s
    never_give_up(client.transaction)


def never_give_up(transactions: Any) -> None:
    """pymodbus closes the line by itself after some late replies: whether a line is lost is ours to say."""
    transactions.max_until_disconnect = transactions.count_until_disconnect = 1_000_000_000
