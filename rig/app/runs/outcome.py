"""What came of the runs: as JSON, and whether that is what was asked for."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from rig.channels import PNEUMATIC, Channels
from rig.errors import CheckFailed, Interrupted, beside
from rig.number_text import counted
from rig.own_units import own_plain
from rig.realtime.faults import Fault
from rig.service.records.recorder_messages import RunResult
from rig.service.session.session_end import SessionEnd

ASKED_FOR: Final = (Fault.ESTOP, Fault.TERMINATED)
"""How a rig stops when somebody interrupts it: by the second Ctrl-C, and by a signal that went to its loop as well."""


@dataclass
class RunOutcome:
    """What came of it all."""

    runs: list[RunResult]
    planned: int
    interrupted: bool = False
    error: str = ""
    recorder_lost: bool = False
    realtime: Mapping[str, str] = field(default_factory=dict)
    end: SessionEnd = field(default_factory=SessionEnd)
    """What became of the rig."""
    channels: Channels = PNEUMATIC
    """Of the rig: whose units are told."""

    def to_json(self) -> dict[str, Any]:
        """The result in the shape that `--json` promises, in the rig's own units."""
        keys = ("ticks", "missed", "dropped", "valid", "complete", "ended", "lateness_us", "error", "angle_zero_deg")
        runs = [
            {"file": str(r.file), **own_plain({k: getattr(r, k) for k in keys}, self.channels), "fault": r.cause}
            for r in self.runs
        ]
        return {"runs": runs, "interrupted": self.interrupted, "error": self.error, "realtime": dict(self.realtime)} | {
            "safe_state": {"outcome": self.end.report.outcome.name.lower(), "by": self.end.report.writer.name.lower()}
        }

    @property
    def stopped(self) -> bool:
        """Somebody or something stopped the rig before it was done."""
        return self.interrupted or bool(self.error) or self.end.unsafe or any(run.fault for run in self.runs)

    @property
    def _rest(self) -> str:
        """What became of the rig, for the end of a bad line; nothing where it never was under way."""
        return f"; {self.end.words}" if self.end.ticked else ""

    def judge(self, also: str = "") -> None:
        """CheckFailed after a fault, an error, a rig that is not known to be safe or an invalid run, Interrupted after
        an interrupted one that was none of these; `also`: what else went wrong, for the end of that line."""
        try:
            self._judge()
        except (CheckFailed, Interrupted) as error:
            raise beside(error, also) if also else error from None

    def _judge(self) -> None:
        faults = [r for r in self.runs if r.fault and not (self.interrupted and r.fault in ASKED_FOR)]
        if faults:
            raise CheckFailed(f"{faults[0].file.name}: {faults[0].cause}{self._rest}")
        if self.error:
            raise CheckFailed(self.error + self._rest)
        if self.end.unsafe:
            raise CheckFailed(self.end.words)
        if self.interrupted:
            raise Interrupted(f"interrupted; {self.end.words}")
        invalid = [r for r in self.runs if not r.valid]
        if invalid:
            first = invalid[0]
            lost = (
                f"{counted(first.missed, 'tick')} missed, {first.dropped} dropped"
                if first.missed or first.dropped
                else str(first.ended)
            )
            why = f"not valid: {first.error or lost}{self._rest}"
            raise CheckFailed(why if first.file.name in first.error else f"{first.file}: {why}")
        if len(self.runs) < self.planned:
            raise CheckFailed(f"{len(self.runs)} of {self.planned} runs were recorded{self._rest}")
