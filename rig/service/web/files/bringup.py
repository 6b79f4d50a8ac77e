"""The steps of bringing a rig up and calibrating it, as docs/how-to/bring_up.md has them: what each is done with on the
command line, what the daemon sees of it by itself, what an operator has confirmed, and which comes next."""

import json
import shlex
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from rig.config import load
from rig.errors import RigError
from rig.rig_config import RigConfig
from rig.service.records.durable_file import DurableFile

Seen = Callable[[dict[str, Any]], str]
"""What of a step can be seen in a status; empty when it cannot be seen to be done."""


@dataclass(frozen=True)
class BringUpStep:
    """One of them."""

    name: str
    title: str
    do: str
    command: str = ""
    """`{rig}` stands for the rig's file."""
    moves: bool = False
    """Something may move, or be under pressure."""
    seen: str = ""
    """Which of `SEEN` looks for it."""


def _punctual(status: dict[str, Any]) -> str:
    """Every real-time measure is granted, and the loop is on time."""
    late = (status.get("lateness_us") or {}).get("p99")
    if status.get("denied") or late is None or not status.get("loop", {}).get("live"):
        return ""
    return f"all real-time measures granted, lateness p99 {late:.0f} us now"


def _reading(status: dict[str, Any]) -> str:
    loop = status.get("loop") or {}
    if not loop.get("live") or status.get("fault") or loop.get("p1_mpa") is None or loop.get("angle_deg") is None:
        return ""
    return "the loop reads pressures and angle now, without a fault"


SEEN: Final[dict[str, Seen]] = {"": lambda _: "", "punctual": _punctual, "reading": _reading}


@dataclass(frozen=True)
class _File:
    steps: list[BringUpStep]


def all_steps() -> list[BringUpStep]:
    """The steps in their order."""
    return load(Path(__file__).with_name("bringup_steps.yaml"), _File).steps


class BringUp:
    """What has been done of them; what an operator confirms is kept in a file."""

    def __init__(self, rig: RigConfig, kept: Path) -> None:
        self._rig, self._kept, self._steps = rig, DurableFile(kept), all_steps()

    def to_json(self, status: dict[str, Any]) -> dict[str, Any]:
        """Every step with what is known of it, and the name of the next."""
        confirmed = self._confirmed() or {}
        steps = [self._step(step, status, confirmed.get(step.name)) for step in self._steps]
        upcoming = next((step["name"] for step in steps if not step["done"]), None)
        return {"steps": steps, "next": upcoming, "calibrated": self._calibrated()}

    def confirm(self, name: str, by: str, *, done: bool) -> None:
        """An operator says that a step is done, or no longer; RigError when there is none of that name."""
        if name not in {step.name for step in self._steps}:
            raise RigError(f"{name[:40]!a}: no such step")
        confirmed = self._confirmed()
        self._kept.unreadable = confirmed is None
        confirmed = confirmed or {}
        confirmed.pop(name, None)
        if done:
            confirmed[name] = {"at_s": time.time(), "by": by}
        self._kept.replace(json.dumps(confirmed))

    def _step(self, step: BringUpStep, status: dict[str, Any], confirmed: Any) -> dict[str, Any]:
        seen = SEEN[step.seen](status)
        return {
            "name": step.name,
            "title": step.title,
            "do": step.do,
            "command": step.command.format(rig=shlex.quote(str(self._rig.path))),
            "moves": step.moves,
            "seen": seen,
            "confirmed": confirmed,
            "done": bool(seen or confirmed),
        }

    def _calibrated(self) -> list[str]:
        """Roles that the rig's calibration names."""
        return sorted(str(role) for role in self._rig.calibration)

    def _confirmed(self) -> dict[str, Any] | None:
        """By the name of a step; None when the file holds something else."""
        try:
            read = json.loads(self._kept.path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, RecursionError):
            return None
        return read if isinstance(read, dict) and all(isinstance(each, dict) for each in read.values()) else None
