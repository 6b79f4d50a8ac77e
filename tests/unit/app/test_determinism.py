"""On the virtual clock one seed is one history: every sample of two runs is the same, bit for bit, in every field."""

import json
from pathlib import Path

import pytest
from support.records.mcap_files import Contents, contents
from support.run_command import pamrig

from rig.sample import Phase, pack

SWEEP = """\
name: twice
settle_s: 0.5
zero_s: 0.2
ramp_in_s: 0.2
duration_s: 2.0
ramp_out_s: 0.3
records:
  - sine: {frequency_hz: [0.5, 1.0], amplitude_mpa: 0.15}
  - mixed: {frequency_hz: 0.5, amplitude_mpa: 0.1}
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Contents]]:
    """The same sweep twice with one seed and once with another."""
    folder = tmp_path_factory.mktemp("determinism")
    (folder / "twice.yaml").write_text(SWEEP)
    found = {}
    for name, seed in (("first", 11), ("again", 11), ("other", 12)):
        done = pamrig(
            "run", folder / "twice.yaml", "--clock", "virtual", "--seed", seed, "--out", folder / name, "--json", "-"
        )
        done.check_returncode()
        found[name] = [contents(Path(run["file"])) for run in json.loads(done.stdout)["runs"]]
    return found


def test_one_seed_is_one_history(runs: dict[str, list[Contents]]) -> None:
    assert len(runs["first"]) == 3
    for first, again in zip(runs["first"], runs["again"], strict=True):
        assert [pack(s) for s in first.samples] == [pack(s) for s in again.samples]
        assert first.lines == again.lines
        assert first.result == again.result
        assert first.result["valid"] == "true"


def test_only_the_wall_clock_and_the_sessions_number_tell_them_apart(runs: dict[str, list[Contents]]) -> None:
    """The number is drawn: it names the shared memory of sessions that may run at the same time. Other numbers of as
    many digits take more or fewer bytes once compressed, so the lengths of the files differ a little."""
    for first, again in zip(runs["first"], runs["again"], strict=True):
        assert first.run.keys() == again.run.keys()
        assert {k for k in first.run if first.run[k] != again.run[k]} == {"session", "started_ns", "crc32"}
    offsets = {
        file.log_times_ns[0] - file.samples[0].scheduled_ns for name in ("first", "again") for file in runs[name]
    }
    assert len(offsets) == 2


def test_another_seed_is_another_history_under_the_same_commands(runs: dict[str, list[Contents]]) -> None:
    for first, other in zip(runs["first"], runs["other"], strict=True):
        assert len(first.samples) == len(other.samples)
        swept = [(a, b) for a, b in zip(first.samples, other.samples, strict=True) if a.phase == Phase.SWEEP]
        assert all((a.p1_cmd_mpa, a.p2_cmd_mpa) == (b.p1_cmd_mpa, b.p2_cmd_mpa) for a, b in swept)
        assert sum(a.angle_raw != b.angle_raw for a, b in swept) > len(swept) / 2


def test_virtual_time_is_exact(runs: dict[str, list[Contents]]) -> None:
    samples = [s for file in runs["first"] for s in file.samples]
    assert all(s.scheduled_ns == s.woken_ns == s.read_ns == s.written_ns for s in samples)
    assert {s.missed for s in samples} == {0}
    assert [s.tick for s in samples] == sorted({s.tick for s in samples})
