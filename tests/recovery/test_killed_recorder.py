"""SIGKILL of the recording process at random moments: at most a second is gone, and nothing that is saved is false.

`pamrig bench log` does the same 50 times.
"""

from pathlib import Path

from rig.qualify.benchmarks.recorder_kill import killed_recordings


def test_a_killed_recorder_loses_at_most_a_second(tmp_path: Path) -> None:
    results = killed_recordings(5, tmp_path, seed=11)
    assert all(result.put > 50 for result in results)
    assert any(result.saved for result in results)
    assert [result.false for result in results] == [0] * 5
    assert max(result.lost_s for result in results) <= 1.0
