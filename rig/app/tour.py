"""What `make run` does: the whole way once, on the simulated rig, by the commands that a user would type.

Sweep and record, identify and validate, replay, then the diagnosis of what has changed on another rig.
"""

import subprocess
import sys
import time
from pathlib import Path

from rig.app.runs import runner
from rig.app.terminal import console, styled


def steps(out: Path) -> list[tuple[str, list[list[str]]]]:
    """What each step shows, and its command lines, which run side by side: only what needs no true period has
    company."""
    baselines = [out / f"baseline_{n}" for n in (1, 2, 3)]
    model, worn = out / "model.yaml", out / "worn"
    sine = out / "quick" / "sine_0.5hz_0.20mpa.mcap"
    virtual = ["--clock", "virtual"]
    sessions = [
        ["run", "gap", *virtual, "--seed", f"{seed}", "--out", f"{folder}"] for seed, folder in enumerate(baselines, 11)
    ]
    changed = ["run", "gap", *virtual, "--seed", "21", "--rig", "simulated_worn", "--out", f"{worn}"]
    return [
        ("One sine in real time, a tick each 5 ms", [["run", "quick", "--out", f"{out / 'quick'}"]]),
        ("Its hysteresis loop", [["log", "plot", f"{sine}", "-o", f"{out / 'loop.png'}"]]),
        ("The records of the paper, in virtual time", [["run", "paper", *virtual, "--out", f"{out / 'paper'}"]]),
        ("Three healthy sessions for the diagnosis, and one on a rig that has changed", [*sessions, changed]),
        (
            "The model, identified from the first healthy session",
            [["identify", f"{baselines[0]}", "--early-stop", "100", "-o", f"{model}"]],
        ),
        (
            "How well it predicts the paper's records, which it has not seen",
            [["validate", f"{model}", f"{out / 'paper'}"]],
        ),
        ("The recorded commands once more, on the simulator", [["replay", f"{sine}", "-o", f"{out / 'replay.mcap'}"]]),
        (
            "What does a simulator lack that says nothing of this? No earlier day is needed",
            [["gap", "diagnose", "--model", "configs/models/simulated.yaml", "--log", f"{worn}"]],
        ),
        (
            "What has changed (its regulators answer 10 ms later: configs/rigs/simulated_worn.yaml)",
            [
                ["gap", "diagnose", "--model", f"{model}", "--log", f"{worn}"]
                + [word for baseline in baselines for word in ("--baseline", f"{baseline}")]
                + ["--json", f"{out / 'gap.json'}", "--html", f"{out / 'report.html'}"]
            ],
        ),
    ]


def run_together(commands: list[list[str]]) -> int:
    """Run commands side by side; the first status that is not 0, else 0. Of several, each shows its last line only."""
    output = subprocess.PIPE if len(commands) > 1 else None
    running = [
        subprocess.Popen([sys.executable, "-m", "rig.cli.main", *words], stdout=output, text=True) for words in commands
    ]
    for process in running:
        said, _ = process.communicate()
        if said:
            print(said.rstrip().rpartition("\n")[2], flush=True)
    return next((process.returncode for process in running if process.returncode), 0)


def main() -> int:
    """Run every step; the first that fails ends it with its status."""
    out = runner.new_folder("tour")
    terminal = console()
    begun = time.monotonic()
    programme = steps(out)
    in_real_time = programme[0][1]
    for title, commands in programme:
        terminal.print(f"\n{title}", style="bold")
        for words in commands:
            terminal.print(f"$ pamrig {' '.join(words)}", style="dim", soft_wrap=True)
        sys.stdout.flush()
        status = run_together(commands)
        if status == 1 and commands is in_real_time:
            status = _again_in_virtual_time(out, commands[0])
        if status:
            terminal.print(f"that ended with status {status}", style="red")
            return status
    done = f"\nDone in {time.monotonic() - begun:.0f} s. Open "
    terminal.print(
        styled(done, (f"{out / 'report.html'}", "bold"), " in a browser; everything else lies beside it."),
        soft_wrap=True,
    )
    return 0


def _again_in_virtual_time(out: Path, words: list[str]) -> int:
    """A machine that stood still for some periods has ended the real-time step; the tour goes on without its clock."""
    (out / "quick").rename(out / "quick_in_real_time")
    console().print(
        "this machine did not hold 5 ms just now (pamrig latency shows how well it can); once more in virtual time",
        style="yellow",
    )
    return run_together([[*words, "--clock", "virtual"]])


if __name__ == "__main__":
    sys.exit(main())
