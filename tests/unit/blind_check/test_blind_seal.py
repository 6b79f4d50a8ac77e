"""Seal and sandbox of the blind check: labels stay closed, and the answering process cannot get at them."""

import contextlib
import hashlib
import json
import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import rig
from rig.blind_check.folder import read_json
from rig.blind_check.sandbox import LAYERS
from rig.blind_check.seal import new_key, open_sealed, seal
from rig.errors import RecordError

LABELS = {"seed": 7, "cases": [{"effects": ["valve_lag"]}, {"effects": []}]}

PROBE = """
import ctypes, json, os, socket, sys
from pathlib import Path
import rig
root, shut_in = Path(sys.argv[1]), sys.argv[2] == "shut_in"
layers = []
if shut_in:
    from rig.blind_check import sandbox
    layers = sandbox.enter([root / "questions" / "a"], [root / "answers"])
libc = ctypes.CDLL(None, use_errno=True)
TGKILL = {"x86_64": 234, "aarch64": 131}[os.uname().machine]
MSGGET = {"x86_64": 68, "aarch64": 186}[os.uname().machine]
TIOCSTI = 0x5412
import resource
os.sched_setaffinity(0, os.sched_getaffinity(0))
resource.setrlimit(resource.RLIMIT_NOFILE, resource.getrlimit(resource.RLIMIT_NOFILE))
def outcome(action):
    try:
        return bool(action() or True)
    except (OSError, ImportError):
        return False
def by_the_c_library(number):
    if number < 0:
        raise OSError
def reached(family, kind, place):
    libc.connect.argtypes = libc.sendto.argtypes = None
    with socket.socket(family, kind) as door:
        address = socket_address(family, place)
        by_the_c_library(libc.connect(door.fileno(), address, len(address)))
        by_the_c_library(libc.send(door.fileno(), b"x", 1, 0))
def marked(path):
    os.setxattr(path, "user.planted_by_the_probe", b"x")
    os.removexattr(path, "user.planted_by_the_probe")
def socket_address(family, place):
    if family == socket.AF_UNIX:
        return family.to_bytes(2, sys.byteorder) + os.fsencode(place) + bytes(1)
    return family.to_bytes(2, sys.byteorder) + place.to_bytes(2, "big") + bytes([127, 0, 0, 1]) + bytes(8)
planted = Path(rig.__file__).parent / "__pycache__" / "planted_by_the_probe.nbi"
print(json.dumps([layers, {
    "question": outcome(lambda: (root / "questions" / "a" / "question.json").read_text()),
    "answer": outcome(lambda: (root / "answers" / "a.json").write_text("{}")),
    "key": outcome(lambda: (root / "maker" / "key").read_text()),
    "labels": outcome(lambda: (root / "maker" / "labels.sealed").read_bytes()),
    "other question": outcome(lambda: (root / "questions" / "b" / "question.json").read_text()),
    "list": outcome(lambda: os.listdir(root / "maker")),
    "overwrite": outcome(lambda: (root / "questions" / "a" / "question.json").write_text("{}")),
    "parent": outcome(lambda: Path(f"/proc/{os.getppid()}/cmdline").read_bytes()),
    "generator": outcome(lambda: __import__("hil.reference.cases")),
    "libc": outcome(lambda: by_the_c_library(libc.open(os.fsencode(root / "maker" / "key"), 0))),
    "plant": outcome(lambda: by_the_c_library(libc.creat(os.fsencode(planted), 0o600))),
    "size of the labels": outcome(lambda: os.stat(root / "maker" / "labels.sealed")),
    "unix socket": outcome(lambda: reached(socket.AF_UNIX, socket.SOCK_STREAM, root / "door")),
    "datagram": outcome(lambda: reached(socket.AF_INET, socket.SOCK_DGRAM, int(sys.argv[3]))),
    "signal": outcome(lambda: by_the_c_library(libc.kill(os.getppid(), 0))),
    "message for the next": outcome(lambda: by_the_c_library(libc.syscall(MSGGET, 0, 0o600))),
    "mark at the question": outcome(lambda: os.chmod(root / "questions" / "a", 0o755)),
    "time of the question": outcome(lambda: os.utime(root / "questions" / "a", (1, 1))),
    "mark at the program": outcome(lambda: marked(rig.__file__)),
    "limit of another": outcome(lambda: resource.prlimit(os.getppid(), resource.RLIMIT_CPU)),
    "place of another": outcome(lambda: os.sched_setaffinity(os.getppid(), os.sched_getaffinity(0))),
    "rank of another": outcome(lambda: os.setpriority(os.PRIO_PROCESS, os.getppid(), os.getpriority(0, os.getppid()))),
    "signal to a thread": outcome(lambda: by_the_c_library(libc.syscall(TGKILL, os.getppid(), os.getppid(), 0))),
}]))
"""
GUARDED_BY = {
    "key": "audit", "labels": "audit", "other question": "audit", "list": "audit", "parent": "audit",
    "generator": "audit",
    "libc": "landlock", "overwrite": "landlock", "plant": "landlock", "unix socket": "seccomp", "datagram": "seccomp",
    "signal": "seccomp", "signal to a thread": "seccomp",
    "message for the next": "seccomp", "mark at the question": "seccomp", "time of the question": "seccomp",
    "mark at the program": "seccomp", "limit of another": "seccomp", "place of another": "seccomp",
    "rank of another": "seccomp",
    "size of the labels": "namespaces",
}  # fmt: skip
"""What the probe tries -> the layer that must stand for it to fail."""


@pytest.fixture
def check_folder(tmp_path: Path) -> Path:
    key = new_key()
    for name in ("questions/a", "questions/b", "answers", "maker"):
        (tmp_path / name).mkdir(parents=True)
    for name in "ab":
        (tmp_path / "questions" / name / "question.json").write_text("{}")
    (tmp_path / "maker" / "key").write_text(key.hex())
    (tmp_path / "maker" / "labels.sealed").write_bytes(seal(LABELS, key).blob)
    return tmp_path


@pytest.fixture
def doors(check_folder: Path) -> Iterator[int]:
    """Somebody listens outside: on a Unix socket in the check's folder, and on the datagram port that is given."""
    with socket.socket(socket.AF_UNIX) as unix, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as datagram:
        unix.bind(str(check_folder / "door"))
        unix.listen()
        datagram.bind(("127.0.0.1", 0))
        yield datagram.getsockname()[1]


def probe(root: Path, how: str, port: int) -> tuple[list[str], dict[str, bool]]:
    call = [sys.executable, "-I", "-c", PROBE, str(root), how, str(port)]
    try:
        layers, said = json.loads(subprocess.run(call, capture_output=True, text=True, check=True, cwd=root).stdout)
    finally:
        (Path(rig.__file__).parent / "__pycache__" / "planted_by_the_probe.nbi").unlink(missing_ok=True)
    return layers, said


def test_the_shut_in_process_reads_its_question_and_nothing_of_the_labels(check_folder: Path, doors: int) -> None:
    layers, said = probe(check_folder, "shut_in", doors)
    assert said["question"]
    assert said["answer"]
    assert set(layers) <= set(LAYERS)
    assert [name for name, layer in GUARDED_BY.items() if layer in layers and said[name]] == []


def test_without_the_sandbox_the_same_probe_reads_everything(check_folder: Path, doors: int) -> None:
    _, said = probe(check_folder, "free", doors)
    assert [name for name in GUARDED_BY if not said[name]] == [], "the probe can tell an open door from a closed one"


def test_an_answer_is_a_plain_file_and_nothing_that_never_ends_or_leads_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"modes": {}}')
    (tmp_path / "link.json").symlink_to("a.json")
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "deep.json").write_text("[" * 100_000)
    assert read_json(tmp_path / "a.json") == {"modes": {}}
    said = {"link": "is a link", "pipe": "it is not a regular file", "deep": "is not JSON", "none": "no such file"}
    for name, why in said.items():
        with pytest.raises(RecordError, match=f"{name}.json: .*{why}"):
            read_json(tmp_path / f"{name}.json")


def test_layers_that_a_system_refuses_are_left_out(check_folder: Path) -> None:
    """A process that may not have namespaces any more, nor filters, still answers, and says so."""
    refuse = "import ctypes, os\nfrom rig.blind_check.sandbox import namespaces, seccomp, enter\n"
    refuse += "namespaces._NEW_USER = namespaces._NEW_MOUNTS = -1\nseccomp._MACHINES.clear()\nprint(*enter([], []))"
    said = subprocess.run([sys.executable, "-c", refuse], capture_output=True, text=True, check=True).stdout.split()
    assert not {"namespaces", "seccomp"} & set(said)
    assert "audit" in said


def test_the_answering_process_is_told_nothing_but_places(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from rig.blind_check import answer

    seen: dict[str, object] = {}

    def fake_run(call: list[str], **options: object) -> "subprocess.CompletedProcess[str]":
        seen.update(options, call=call)
        return subprocess.CompletedProcess(call, 0, "", "")

    monkeypatch.setattr(answer.subprocess, "run", fake_run)
    monkeypatch.setenv("CHECK_SEED", "12345")
    answer.answer_cases(str(tmp_path / "questions"), str(tmp_path / "answers"), ["a1"])
    call = seen["call"]
    assert isinstance(call, list)
    assert call[:4] == [sys.executable, "-I", "-B", "-c"]
    assert call[5:] == [
        str(Path(answer.__file__).parents[2]),
        str(os.getpid()),
        str(tmp_path / "questions"),
        str(tmp_path / "answers"),
        "a1",
    ]
    environment = seen["env"]
    assert isinstance(environment, dict)
    assert set(environment) <= {*answer.KEPT_ENVIRONMENT, *answer.ONE_THREAD, "NUMBA_CACHE_DIR"}
    assert seen["stdin"] is subprocess.DEVNULL


def test_a_check_is_answered_by_the_package_that_asks(tmp_path: Path) -> None:
    """Another checkout asks, found by PYTHONPATH, which the isolated answering process does not look at."""
    checkout, questions = tmp_path / "checkout", tmp_path / "questions"
    shutil.copytree(Path(rig.__file__).parent, checkout / "rig", ignore=shutil.ignore_patterns("__pycache__"))
    with (checkout / "rig" / "blind_check" / "answer.py").open("a") as copied:
        copied.write("\n\ndef answer_question(place, known=None):\n    return {'by': __file__}\n")
    (questions / "a" / "records").mkdir(parents=True)
    ask = "from rig.blind_check.answer import answer_cases; import sys; answer_cases(*sys.argv[1:3], ['a'])"
    call = [sys.executable, "-c", ask, str(questions), str(tmp_path / "answers")]
    subprocess.run(call, check=True, env=os.environ | {"PYTHONPATH": str(checkout)}, cwd=tmp_path)
    assert Path(read_json(tmp_path / "answers" / "a.json")["by"]).is_relative_to(checkout)


ENDED_SOON_S = 60.0
ASKING = """
import sys
from rig.blind_check.answer import answer_cases
from rig.parallel import executor
if __name__ == "__main__":
    with executor(workers=1) as pool:
        pool.submit(answer_cases, sys.argv[1], sys.argv[2], ["a"] * 3000).result()
"""


@pytest.mark.real_time
def test_nobody_goes_on_answering_for_a_check_that_was_ended(tmp_path: Path) -> None:
    """The answering process has its question in its command line; the workers hold the end of what they all print."""
    records, script = tmp_path / "questions" / "a" / "records", tmp_path / "asking.py"
    records.mkdir(parents=True)
    rows = (f"{n / 100},{n % 50 / 100},{n % 50}" for n in range(1000))
    (records / "x.csv").write_text("\n".join(["t_s,dp_cmd_mpa,angle_deg", *rows]))
    (records.parent / "question.json").write_text('{"modes": [], "leave_out": []}')
    script.write_text(ASKING)
    call = [sys.executable, str(script), str(tmp_path / "questions"), str(tmp_path / "answers")]
    with subprocess.Popen(call, stdout=subprocess.PIPE) as asking:
        try:
            became(lambda: (tmp_path / "answers" / "a.json").exists(), "the first of many answers")
        finally:
            asking.terminate()
        asking.communicate(timeout=ENDED_SOON_S)
        became(lambda: not named_in_a_call(tmp_path), "the end of the answering process")
    assert named_in_a_call(tmp_path) == []


def named_in_a_call(place: Path) -> list[Path]:
    """The processes that have it in their command line."""
    found = []
    for line in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            found += [line] if os.fsencode(place) in line.read_bytes() else []
    return found


def became(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + ENDED_SOON_S
    while not condition():
        assert time.monotonic() < deadline, f"waited in vain for {what}"
        time.sleep(0.02)


def test_seal_opens_with_its_key_and_the_hash_is_that_of_the_labels() -> None:
    key = new_key()
    sealed = seal(LABELS, key)
    assert open_sealed(sealed.blob, key, sealed.sha256, "here") == LABELS
    assert (
        sealed.sha256 == hashlib.sha256(json.dumps(LABELS, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
    )
    assert b"valve_lag" not in sealed.blob


@pytest.mark.parametrize("what", ["blob", "key", "hash"])
def test_a_changed_seal_is_refused(what: str) -> None:
    key = new_key()
    sealed = seal(LABELS, key)
    blob, sha256 = sealed.blob, sealed.sha256
    if what == "blob":
        blob = bytes([blob[0] ^ 1]) + blob[1:]
    elif what == "key":
        key = new_key()
    else:
        sha256 = "0" * 64
    with pytest.raises(RecordError, match=r"^here: "):
        open_sealed(blob, key, sha256, "here")


def test_every_key_is_new() -> None:
    assert new_key() != new_key()
