"""What the electronics of a serial regulator understand and answer: bytes in, bytes out. No port, no time, no thread.

Written from the description of the protocol, apart from the driver's codec, so that an error in one does not hide in
the other.
"""

from collections.abc import Callable
from dataclasses import dataclass

_LONGEST_LINE = 64


@dataclass(frozen=True)
class RegulatorDialect:
    """The words of one variant. The defaults are what is known of SMC's RS-232C variants."""

    set_word: str = "SET"
    monitor_word: str = "MON"
    request_word: str = "REQ"
    increase_word: str = "INC"
    decrease_word: str = "DEC"
    separator: str = " "
    terminator: str = "\r\n"
    set_answer: str = "{count}"
    """Empty: a set-point is not answered."""
    monitor_answer: str = "{count}"
    unknown: str = "UNKNOWN COMMAND"
    out_of_range: str = "OUT OF RANGE"
    echo: bool = False
    full_scale_counts: int = 1023
    full_scale_mpa: float = 0.5


class Regulator:
    """One regulator: keeps its set-point, forwards it to the plant, reads its own pressure sensor."""

    def __init__(
        self, dialect: RegulatorDialect, obey: Callable[[float], None], pressure_mpa: Callable[[], float]
    ) -> None:
        self._dialect, self._obey, self._pressure_mpa = dialect, obey, pressure_mpa
        self._heard = b""
        self.set_point = 0
        """Counts; what the valve follows as long as it has power."""

    def receive(self, data: bytes) -> bytes:
        """Bytes from the line; returns what is answered to the commands that they complete."""
        self._heard += data
        answers = b""
        end = self._dialect.terminator.encode()
        while end in self._heard:
            line, self._heard = self._heard.split(end, 1)
            answers += self._answer(line)
        self._heard = self._heard[-_LONGEST_LINE:]
        return answers

    def start_from(self, pressure_mpa: float) -> None:
        """The set-point that somebody left behind."""
        self.set_point = round(pressure_mpa / self._dialect.full_scale_mpa * self._dialect.full_scale_counts)

    def forget(self) -> None:
        """Power off and on: a half command is lost, the set-point is zero again."""
        self._heard = b""
        self.set_point = 0

    def _answer(self, line: bytes) -> bytes:
        dialect = self._dialect
        text = line.decode("ascii", "replace")
        echo = line + dialect.terminator.encode() if dialect.echo else b""
        answer = self._obeyed(text)
        return echo + ((answer + dialect.terminator).encode() if answer else b"")

    def _obeyed(self, text: str) -> str:
        dialect = self._dialect
        if text == dialect.monitor_word:
            return dialect.monitor_answer.format(count=self.monitored())
        if text == dialect.request_word:
            return str(self.set_point)
        word, _, number = (
            text.partition(dialect.separator)
            if dialect.separator
            else (text[: len(dialect.set_word)], "", text[len(dialect.set_word) :])
        )
        if not number.isdecimal():
            return dialect.unknown
        wanted = {
            dialect.set_word: int(number),
            dialect.increase_word: self.set_point + int(number),
            dialect.decrease_word: self.set_point - int(number),
        }.get(word)
        if wanted is None:
            return dialect.unknown
        if not 0 <= wanted <= dialect.full_scale_counts:
            return dialect.out_of_range
        self.set_point = wanted
        self._obey(wanted * dialect.full_scale_mpa / dialect.full_scale_counts)
        return dialect.set_answer.format(count=wanted)

    def monitored(self) -> int:
        """Its pressure sensor, in counts of full scale."""
        counts = round(self._pressure_mpa() / self._dialect.full_scale_mpa * self._dialect.full_scale_counts)
        return min(max(counts, 0), self._dialect.full_scale_counts)
