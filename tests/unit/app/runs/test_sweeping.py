"""What `pamrig run` makes of a sweep, before anything moves: its folder, and what its records keep of it."""

from pathlib import Path

import pytest

from rig.app import compose, shipped
from rig.app.runs import record_folders, runner, sweeping
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.runner import Planned, RunOptions
from rig.excite.run_plan import RunPlan, expand
from rig.excite.sweep import Sweep
from rig.rig_config import RigConfig
from rig.service.records.record_names import free


def test_two_runs_of_one_second_have_a_folder_each(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two rigs that a script sets in motion at once: the second ended at the first one's records."""
    monkeypatch.chdir(tmp_path)
    out: list[Path] = []

    def carried_out(_: RigConfig, __: list[Planned], options: RunOptions) -> RunOutcome:
        out.append(options.out)
        return RunOutcome([], 0)

    monkeypatch.setattr(runner, "carry_out", carried_out)
    monkeypatch.setattr(record_folders, "new_folder", lambda name: free(Path("logs") / name))
    for _ in range(2):
        sweeping.run_sweep(Path("quick"), compose.load(None), sweeping.SweepOptions(virtual=True))
    assert out[0] != out[1]
    (tmp_path / "logs" / "quick_again3").mkdir()
    looks = iter([Path("logs/quick_again3"), Path("logs/quick_again4")])  # somebody made it since
    monkeypatch.setattr(record_folders, "new_folder", lambda _: next(looks))
    assert record_folders.made_folder("quick") == Path("logs/quick_again4")


def test_a_record_keeps_the_sweep_that_it_was_made_from_and_not_what_became_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A long sweep takes half a minute to expand, in which somebody goes on editing."""
    file, text = tmp_path / "s.yaml", (shipped.configs() / "sweeps" / "quick.yaml").read_text()
    file.write_text(text)
    attached: list[bytes] = []

    def edited(plan: Sweep, period_ns: int) -> list[RunPlan]:
        file.write_text("records: []")
        return expand(plan, period_ns)

    def carried_out(_: RigConfig, __: list[Planned], options: RunOptions) -> RunOutcome:
        attached.append(options.attachments["sweep.yaml"])
        return RunOutcome([], 0)

    monkeypatch.setattr(sweeping, "expand", edited)
    monkeypatch.setattr(runner, "carry_out", carried_out)
    sweeping.run_sweep(file, compose.load(None), sweeping.SweepOptions(tmp_path / "out", virtual=True))
    assert attached == [text.encode()]
