"""Seal and sandbox of the blind check: labels stay closed, and the answering process cannot get at them."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from rig.blind_check.seal import new_key, open_sealed, seal
from rig.errors import RecordError

pytestmark = pytest.mark.real_time

LABELS = {"seed": 7, "cases": [{"effects": ["valve_lag"]}, {"effects": []}]}

PROBE = """
import ctypes, json, os, sys
from pathlib import Path
root, shut_in = Path(sys.argv[1]), sys.argv[2] == "shut_in"
if shut_in:
    from rig.blind_check import sandbox
    sandbox.enter([root / "questions" / "a"], [root / "answers"])
def outcome(action):
    try:
        return bool(action() or True)
    except (OSError, ImportError):
        return False
def by_the_c_library():
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.open(os.fsencode(root / "maker" / "key"), 0) < 0:
        raise OSError
print(json.dumps({
    "question": outcome(lambda: (root / "questions" / "a" / "question.json").read_text()),
    "answer": outcome(lambda: (root / "answers" / "a.json").write_text("{}")),
    "key": outcome(lambda: (root / "maker" / "key").read_text()),
    "labels": outcome(lambda: (root / "maker" / "labels.sealed").read_bytes()),
    "other question": outcome(lambda: (root / "questions" / "b" / "question.json").read_text()),
    "list": outcome(lambda: os.listdir(root / "maker")),
    "overwrite": outcome(lambda: (root / "questions" / "a" / "question.json").write_text("{}")),
    "parent": outcome(lambda: Path(f"/proc/{os.getppid()}/cmdline").read_bytes()),
    "generator": outcome(lambda: __import__("hil.reference.cases")),
    "libc": outcome(by_the_c_library),
}))
"""
SECRET = ("key", "labels", "other question", "list", "overwrite", "parent", "generator", "libc")


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


def probe(root: Path, how: str) -> dict[str, bool]:
    call = [sys.executable, "-I", "-c", PROBE, str(root), how]
    said: dict[str, bool] = json.loads(subprocess.run(call, capture_output=True, text=True, check=True, cwd=root).stdout)
    return said


def test_the_shut_in_process_reads_its_question_and_nothing_of_the_labels(check_folder: Path) -> None:
    said = probe(check_folder, "shut_in")
    assert said["question"]
    assert said["answer"]
    ask = "from rig.blind_check import sandbox; print(*sandbox.enter([], []))"
    layers = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True).stdout.split()
    guarded = SECRET if "landlock" in layers else [name for name in SECRET if name not in ("libc", "overwrite")]
    assert [name for name in guarded if said[name]] == []


def test_without_the_sandbox_the_same_probe_reads_everything(check_folder: Path) -> None:
    said = probe(check_folder, "free")
    assert [name for name in SECRET if not said[name]] == [], "the probe can tell an open door from a closed one"


def test_the_answering_process_is_told_nothing_but_places(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from rig.blind_check import answer

    seen: dict[str, object] = {}

    def fake_run(call: list[str], **options: object) -> "subprocess.CompletedProcess[str]":
        seen.update(options, call=call)
        return subprocess.CompletedProcess(call, 0, "", "")

    monkeypatch.setattr(answer.subprocess, "run", fake_run)
    monkeypatch.setenv("CHECK_SEED", "12345")
    answer.answer_cases(str(tmp_path / "questions"), str(tmp_path / "answers"), ["a1"])
    assert seen["call"] == [
        sys.executable,
        "-I",
        "-m",
        "rig.blind_check.answer",
        str(tmp_path / "questions"),
        str(tmp_path / "answers"),
        "a1",
    ]
    environment = seen["env"]
    assert isinstance(environment, dict)
    assert set(environment) <= {*answer.KEPT_ENVIRONMENT, *answer.ONE_THREAD}


def test_seal_opens_with_its_key_and_the_hash_is_that_of_the_labels() -> None:
    key = new_key()
    sealed = seal(LABELS, key)
    assert open_sealed(sealed.blob, key, sealed.sha256, "here") == LABELS
    assert sealed.sha256 == hashlib.sha256(json.dumps(LABELS, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
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
