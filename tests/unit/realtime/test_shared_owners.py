"""Whether somebody owns named memory, asked by two at once."""

import subprocess
import sys

import pytest
from support.shared_names import unused_name

from rig.realtime.shared import SharedBlock, folder

name = pytest.fixture(unused_name)


def test_two_who_ask_at_once_take_each_other_for_no_owner(name: str) -> None:
    """Each of them looked by the lock itself: a dead process's block was in use, by his pid, and its black box was left
    where it was."""
    make = f"from rig.realtime.shared import SharedBlock; SharedBlock.create({name!r}, 7, 64)"
    subprocess.run([sys.executable, "-c", make], check=True)
    path = folder() / f"pamrig-{name}"
    SharedBlock.attach(path).words[5] = 0  # made long ago
    code = (
        "import sys, pathlib; from rig.realtime.shared import living_owner; path = pathlib.Path(sys.argv[1]);"
        "print(end='ready\\n', flush=True); sys.stdin.readline();"
        "print(sum(living_owner(path) != 0 for _ in range(5_000)))"
    )
    call, pipe = [sys.executable, "-c", code, str(path)], subprocess.PIPE
    asking = [subprocess.Popen(call, stdin=pipe, stdout=pipe, text=True) for _ in range(2)]
    for each in asking:
        assert each.stdout is not None
        assert each.stdout.readline() == "ready\n"
    for each in asking:
        assert each.stdin is not None
        each.stdin.write("go\n")
        each.stdin.flush()
    assert [each.communicate()[0] for each in asking] == ["0\n", "0\n"]
