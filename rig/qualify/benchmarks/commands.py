"""Commands as processes of their own, whose time is not what is measured."""

import subprocess
import sys

from rig.errors import RigError


def pamrig(*words: object) -> str:
    """What a command says; RigError with its last line when it fails."""
    command = [sys.executable, "-m", "rig.cli.main", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RigError(f"bench: pamrig {words[0]}: {done.stderr.strip().rpartition(chr(10))[2]}")
    return done.stdout
