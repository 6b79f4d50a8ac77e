"""What `make run` does: the whole way once, on the simulated rig, by the commands that a user would type.

Sweep and record, identify and validate, replay, then the diagnosis of what has changed on another rig.
"""

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

from rig.app.runs import record_folders
from rig.app.terminal import console, styled


class TourStep(NamedTuple):
    """What is shown above it, and its command lines; of several, each shows its last line only."""

    title: str
    commands: list[list[str]]


def steps(out: Path) -> list[list[TourStep]]:
    """The steps in their order; those of one group run side by side: none needs another's files, and what needs a true
    period is alone."""
    baselines = [out / f"baseline_{n}" for n in (1, 2, 3)]
    model, worn = out / "model.yaml", out / "worn"
    sine = out / "quick" / "sine_0.5hz_0.20mpa.mcap"
    virtual = ["--clock", "virtual"]
    sessions = [
        ["run", "gap", *virtual, "--seed", f"{seed}", "--out", f"{folder}"] for seed, folder in enumerate(baselines, 11)
    ]
    programme = ["run", "paper", *virtual, "--out", f"{out / 'paper'}"]
    changed = ["run", "gap", *virtual, "--seed", "21", "--rig", "simulated_worn", "--out", f"{worn}"]
    return [
        [TourStep("One sine in real time, a tick each 5 ms", [["run", "quick", "--out", f"{out / 'quick'}"]])],
        [
            TourStep("The records of the paper, in virtual time", [programme]),
            TourStep(
                "Three healthy sessions for the diagnosis, and one on a rig that has changed", [*sessions, changed]
            ),
        ],
        [
            TourStep("The hysteresis loop of the sine", [["log", "plot", f"{sine}", "-o", f"{out / 'loop.png'}"]]),
            TourStep(
                "The model, identified from the first healthy session",
                [["identify", f"{baselines[0]}", "--early-stop", "100", "-o", f"{model}"]],
            ),
        ],
        [
            TourStep(
                "How well it predicts the paper's records, which it has not seen",
                [["validate", f"{model}", f"{out / 'paper'}"]],
            ),
            TourStep(
                "The recorded commands once more, on the simulator",
                [["replay", f"{sine}", "-o", f"{out / 'replay.mcap'}"]],
            ),
            TourStep(
                "What does a simulator lack that says nothing of this? No earlier day is needed",
                [["gap", "diagnose", "--model", "configs/models/simulated.yaml", "--log", f"{worn}"]],
            ),
            TourStep(
                "What has changed (its regulators answer 10 ms later: configs/rigs/simulated_worn.yaml)",
                [
                    ["gap", "diagnose", "--model", f"{model}", "--log", f"{worn}"]
                    + [word for baseline in baselines for word in ("--baseline", f"{baseline}")]
                    + ["--json", f"{out / 'gap.json'}", "--html", f"{out / 'report.html'}"]
                ],
            ),
        ],
    ]


def begun(words: list[str], shown: bool) -> "subprocess.Popen[str]":
    """A command as a process of its own: `shown` as it speaks, else once it is done, as wide as the terminal."""
    wide = os.environ | {"COLUMNS": f"{console().width}"}
    output = None if shown else subprocess.PIPE
    return subprocess.Popen([sys.executable, "-m", "rig.cli.main", *words], stdout=output, text=True, env=wide)


def finish(running: "list[subprocess.Popen[str]]") -> int:
    """Wait for a step's commands and show what they said; the first status that is not 0, else 0."""
    for process in running:
        output, _ = process.communicate()
        if output:
            print(output.rstrip().rpartition("\n")[2] if len(running) > 1 else output.rstrip(), flush=True)
    return next((process.returncode for process in running if process.returncode), 0)


def together(group: list[TourStep]) -> int:
    """Carry out the steps of a group side by side and tell of one after the other; the first status that is not 0."""
    alone = len(group) == 1 and len(group[0].commands) == 1
    running = [[begun(words, alone) for words in step.commands] for step in group]
    statuses = []
    for step, processes in zip(group, running, strict=True):
        announce(step)
        statuses.append(finish(processes))
    return next((status for status in statuses if status), 0)


def announce(step: TourStep) -> None:
    """Its title and its command lines."""
    terminal = console()
    terminal.print(f"\n{step.title}", style="bold")
    for words in step.commands:
        terminal.print(f"$ pamrig {' '.join(words)}", style="dim", soft_wrap=True)
    sys.stdout.flush()


def main(words: list[str]) -> int:
    """Carry out every group, into the folder that `words` names or a new one; the first that fails ends it with its
    status."""
    out = Path(words[0]) if words else record_folders.new_folder("tour")
    terminal = console()
    at_s = time.monotonic()
    programme = steps(out)
    for group in programme:
        status = together(group)
        if status == 1 and group is programme[0]:
            status = _again_in_virtual_time(out, group[0])
        if status:
            terminal.print(f"that ended with status {status}", style="red")
            return status
    done = f"\nDone in {time.monotonic() - at_s:.0f} s. Open "
    terminal.print(
        styled(done, (f"{out / 'report.html'}", "bold"), " in a browser; everything else lies beside it."),
        soft_wrap=True,
    )
    return 0


def _again_in_virtual_time(out: Path, step: TourStep) -> int:
    """A machine that stood still for some periods has ended the real-time step; the tour goes on without its clock."""
    (out / "quick").rename(out / "quick_in_real_time")
    console().print(
        "this machine did not hold 5 ms just now (pamrig latency shows how well it can); once more in virtual time",
        style="yellow",
    )
    return together([TourStep("The same sine in virtual time", [[*step.commands[0], "--clock", "virtual"]])])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
