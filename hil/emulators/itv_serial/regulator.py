"""What the electronics of a serial regulator understand and answer: bytes in, bytes out. No port, no time, no thread.

Written from the description of the protocol, apart from the driver's codec, so that an error in one does not hide in
the other.
"""

from collections.abc import Callable
from dataclasses import dataclass

_LONGEST_LINE = 64


@dataclass(frozen=True)
class Speech:
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

    def __init__(self, speech: Speech, obey: Callable[[float], None], pressure_mpa: Callable[[], float]) -> None:
        self._speech, self._obey, self._pressure_mpa = speech, obey, pressure_mpa
        self._heard = b""
        self.set_point = 0
        """Counts; what the valve follows as long as it has power."""

    def hear(self, data: bytes) -> bytes:
        """Bytes from the line; returns what is answered to the commands that they complete."""
        self._heard += data
        answers = b""
        end = self._speech.terminator.encode()
        while end in self._heard:
            line, self._heard = self._heard.split(end, 1)
            answers += self._answer(line)
        self._heard = self._heard[-_LONGEST_LINE:]
        return answers

    def start_from(self, pressure_mpa: float) -> None:
        """The set-point that somebody left behind."""
        self.set_point = round(pressure_mpa / self._speech.full_scale_mpa * self._speech.full_scale_counts)

    def forget(self) -> None:
        """Power off and on: a half command is lost, the set-point is zero again."""
        self._heard = b""
        self.set_point = 0

    def _answer(self, line: bytes) -> bytes:
        speech = self._speech
        text = line.decode("ascii", "replace")
        echo = line + speech.terminator.encode() if speech.echo else b""
        answer = self._obeyed(text)
        return echo + ((answer + speech.terminator).encode() if answer else b"")

    def _obeyed(self, text: str) -> str:
        speech = self._speech
        if text == speech.monitor_word:
            return speech.monitor_answer.format(count=self.monitored())
        if text == speech.request_word:
            return str(self.set_point)
        word, _, number = (
            text.partition(speech.separator)
            if speech.separator
            else (text[: len(speech.set_word)], "", text[len(speech.set_word) :])
        )
        if not number.isdecimal():
            return speech.unknown
        wanted = {
            speech.set_word: int(number),
            speech.increase_word: self.set_point + int(number),
            speech.decrease_word: self.set_point - int(number),
        }.get(word)
        if wanted is None:
            return speech.unknown
        if not 0 <= wanted <= speech.full_scale_counts:
            return speech.out_of_range
        self.set_point = wanted
        self._obey(wanted * speech.full_scale_mpa / speech.full_scale_counts)
        return speech.set_answer.format(count=wanted)

    def monitored(self) -> int:
        """Its pressure sensor, in counts of full scale."""
        counts = round(self._pressure_mpa() / self._speech.full_scale_mpa * self._speech.full_scale_counts)
        return min(max(counts, 0), self._speech.full_scale_counts)
