"""Hostile inputs tried for hours, in processes that the kernel ends when they hang: what hostile_logs, hostile_configs
and hostile_requests share.

Each of those modules has `one(folder, seed)`: an endless iterator of the processor time that an input may take, its
size, and a call that tries it.
"""

import argparse
import importlib
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MEMORY_BYTES = 3 << 30


def go_on(module: str, seed: int, seconds: float, folder: Path) -> None:
    """Try one input after the other until the time is over; the kernel ends a process that hangs, its file stays."""
    until, slowest, count = time.monotonic() + seconds, (0.0, 0), 0
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, resource.RLIM_INFINITY))
    for allowed_s, size, work in importlib.import_module(module).one(folder, seed):
        resource.setrlimit(resource.RLIMIT_CPU, (int(time.process_time() + allowed_s) + 5, resource.RLIM_INFINITY))
        slowest, count = max(slowest, (work(), size)), count + 1
        if time.monotonic() > until:
            break
    told = {"seed": seed, "inputs": count, "slowest_s": round(slowest[0], 3), "its_bytes": slowest[1]}
    print(json.dumps(told), flush=True)


def main(module: str, described: str) -> int:
    """Work in processes of `--each` seconds, so that one that dies leaves its input and its seed."""
    options = argparse.ArgumentParser(description=described.partition("\n\n")[0])
    options.add_argument("--seconds", type=float, default=60.0)
    options.add_argument("--each", type=float, default=60.0)
    options.add_argument("--seed", type=int, default=1)
    given = options.parse_args()
    until, seed, bad = time.monotonic() + given.seconds, given.seed, 0
    while time.monotonic() < until:
        folder = Path(tempfile.mkdtemp(prefix=f"{module}_{seed}_"))
        each_s = min(given.each, until - time.monotonic())
        work = "from support.hostile_work import Path, go_on; "
        work += f"go_on({module!r}, {seed}, {each_s}, Path({str(folder)!r}))"
        done = subprocess.run([sys.executable, "-c", work], cwd=Path(__file__).parents[1], check=False)
        if done.returncode:
            bad += 1
            print(f"seed {seed}: status {done.returncode}; the input lies in {folder}", flush=True)
        else:
            shutil.rmtree(folder)
        seed += 1
    print(f"{bad} inputs broke the rules", flush=True)
    return 1 if bad else 0
