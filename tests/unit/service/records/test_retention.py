"""Retention: off by itself, and never anything but announced records of the daemon's own ledger."""

import errno
import gc
import os
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from rig.app import shipped
from rig.cli.service.daemon import daemon
from rig.errors import RigError
from rig.service.records.ages import doubts, moment
from rig.service.records.ledger import Ledger, Moment
from rig.service.records.retention import NOTICE_S, Policy, Retention
from rig.service.settings import DaemonSettings, load_settings

DAY_S = 86400.0
NOW_S = 20_500 * DAY_S


class Desk:
    """A folder of logs, a ledger and two clocks that are turned by hand."""

    def __init__(self, folder: Path) -> None:
        self.logs, self.ledger = folder / "logs", Ledger(folder / "records.jsonl")
        self.wall_s, self.clock_s = NOW_S, 0.0
        self.boot, self.up_s = "today's", DAY_S

    def record(
        self, name: str, age_days: float = 1.0, size: int = 100, *, own: bool = True, boot: str = "", up_s: float = 0.0
    ) -> Path:
        """A record under the logs, in the ledger when it is the daemon's `own`."""
        path = self.logs / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(bytes(size))
        os.utime(path, (NOW_S - age_days * DAY_S,) * 2)
        if own:
            self.ledger.add(path, Moment(NOW_S - age_days * DAY_S, boot, up_s))
        return path

    def retention(self, keep_bytes: int | None = None, keep_days: float | None = None) -> Retention:
        keep_s = None if keep_days is None else keep_days * DAY_S
        return Retention(
            self.ledger,
            Policy(keep_bytes, keep_s),
            now=lambda: Moment(self.wall_s, self.boot, self.up_s),
            clock_s=lambda: self.clock_s,
        )

    def gone(self, retention: Retention) -> list[str]:
        """What goes once everything has been announced for long enough."""
        retention.turn()
        self.clock_s += NOTICE_S
        return [Path(entry.path).name for entry in retention.turn()[1]]


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path)


def test_without_a_setting_nothing_ever_goes(desk: Desk) -> None:
    for name in ("a/1.mcap", "a/2.mcap"):
        desk.record(name, age_days=400.0)
    settings = DaemonSettings()
    assert (settings.keep_gb, settings.keep_days) == (None, None)
    assert settings.retention.off
    assert desk.gone(desk.retention()) == []


def test_the_settings_that_are_shipped_delete_nothing() -> None:
    assert load_settings(shipped.configs() / "daemon.yaml").retention.off


def test_records_that_are_too_old_go_after_a_day_of_notice(desk: Desk) -> None:
    old, new = desk.record("a/old.mcap", 50.0), desk.record("a/new.mcap", 1.0)
    retention = desk.retention(keep_days=30.0)
    announced, removed = retention.turn()
    assert ([Path(entry.path) for entry in announced], removed) == ([old], [])
    assert retention.to_json() == {"announced": 1, "first_in_s": NOTICE_S}
    desk.clock_s += NOTICE_S - 1.0
    assert retention.turn() == ([], [])
    assert old.exists()
    desk.clock_s += 1.0
    assert [Path(entry.path) for entry in retention.turn()[1]] == [old]
    assert (old.exists(), new.exists(), retention.to_json()) == (False, True, None)
    assert [entry.path for entry in Ledger(old.parents[2] / "records.jsonl").entries] == [str(new)]


def test_the_oldest_go_until_the_rest_fits(desk: Desk) -> None:
    for age in (4, 3, 2, 1):
        desk.record(f"a/{age}.mcap", age)
    assert desk.gone(desk.retention(keep_bytes=250)) == ["4.mcap", "3.mcap"]


def test_the_newest_of_each_session_stays_and_so_does_its_folder(desk: Desk) -> None:
    kept = []
    for day in (1, 2, 3):
        desk.record(f"{day}/1.mcap", 400.0 - day)
        kept.append(desk.record(f"{day}/2.mcap", 399.9 - day))
    assert desk.gone(desk.retention(keep_bytes=0, keep_days=1.0)) == ["1.mcap"] * 3
    assert all(path.exists() for path in kept)


def test_a_record_that_is_the_last_one_left_of_its_session_stays(desk: Desk) -> None:
    first, second = desk.record("a/1.mcap", 400.0), desk.record("a/2.mcap", 350.0)
    second.unlink()
    assert desk.gone(desk.retention(keep_days=1.0)) == []
    assert first.exists()


@pytest.mark.parametrize(
    "name", ["thesis.mcap", "2019/wrist.mcap", "a/blackbox.mcap", "a/cut.mcap.partial", "notes.txt"]
)
def test_what_the_daemon_did_not_record_is_never_touched(desk: Desk, name: str) -> None:
    foreign = desk.record(name, 3000.0, own=False)
    for number in (1, 2):
        desk.record(f"a/{number}.mcap", 400.0 - number)
    desk.gone(desk.retention(keep_bytes=0, keep_days=1.0))
    assert foreign.exists()


def test_what_somebody_renamed_replaced_or_restored_is_his(desk: Desk) -> None:
    renamed, replaced, copied, linked = (desk.record(f"a/{name}.mcap", 400.0) for name in ("r", "p", "c", "l"))
    folder = desk.record("b/1.mcap", 400.0)
    desk.record("b/2.mcap", 399.0)
    desk.record("a/z.mcap", 1.0)
    renamed.rename(renamed.with_name("for the paper.mcap"))
    replaced.unlink()
    replaced.write_bytes(bytes(100) + b"more")
    copy = copied.with_name("copy")
    copy.write_bytes(copied.read_bytes())
    copy.replace(copied)
    linked.rename(linked.with_name("elsewhere"))
    linked.symlink_to("elsewhere")
    folder.parent.rename(desk.logs / "wrist day 1")
    (desk.logs / "b").symlink_to("wrist day 1")
    assert desk.gone(desk.retention(keep_bytes=0, keep_days=1.0)) == []
    assert all(path.exists() for path in (replaced, copied, linked, folder, renamed.with_name("for the paper.mcap")))


def test_a_notice_is_withdrawn_with_its_reason_and_begins_anew(desk: Desk) -> None:
    old = desk.record("a/old.mcap", 50.0)
    desk.record("a/new.mcap", 1.0)
    retention = desk.retention(keep_days=30.0)
    desk.wall_s += 1e9  # a clock that runs wild, and is put right
    retention.turn()
    desk.wall_s = NOW_S - 40 * DAY_S
    retention.turn()
    desk.wall_s, desk.clock_s = NOW_S, NOTICE_S
    assert retention.turn()[1] == []
    assert old.exists()


# dates of a clock that was wrong


def stays(desk: Desk, caplog: pytest.LogCaptureFixture, old: Path, why: str) -> None:
    """The record `old` is kept by a rule of 30 days although it is dated older, and the log says once why."""
    desk.record("a/newest.mcap", 0.0)
    retention = desk.retention(keep_days=30.0)
    assert desk.gone(retention) == []
    assert old.exists()
    said = [line for line in caplog.messages if str(old) in line]
    assert len(said) == 1, said
    assert said[0].startswith(f"retention: {old} stays, its date is not believed: {why}")


def test_a_record_of_1970_is_not_old(desk: Desk, caplog: pytest.LogCaptureFixture) -> None:
    stays(desk, caplog, desk.record("a/before-ntp.mcap", 20_500.0), "there was no pamrig on 1970-01-01")


def test_a_record_of_this_boot_is_no_older_than_the_boot(desk: Desk, caplog: pytest.LogCaptureFixture) -> None:
    old = desk.record("a/before-ntp.mcap", 200.0, boot=desk.boot, up_s=60.0)
    stays(desk, caplog, old, "the clock has been set since")


def test_a_clock_that_was_set_in_an_earlier_boot_is_seen_by_what_was_recorded_after(
    desk: Desk, caplog: pytest.LogCaptureFixture
) -> None:
    old = desk.record("a/before-ntp.mcap", 200.0, boot="earlier", up_s=60.0)
    desk.record("a/after-ntp.mcap", 2.0, boot="earlier", up_s=600.0)
    stays(desk, caplog, old, "the clock has been set since")


def test_a_record_that_is_dated_before_an_earlier_one_is_not_old(desk: Desk, caplog: pytest.LogCaptureFixture) -> None:
    desk.record("a/first.mcap", 20.0)
    stays(desk, caplog, desk.record("a/second.mcap", 200.0), "it was recorded after one of 2026-01-27")


def test_a_record_of_a_clock_that_was_years_ahead_makes_no_other_one_doubtful(desk: Desk) -> None:
    ahead = desk.record("a/ahead.mcap", -9_000.0)
    old = desk.record("a/old.mcap", 50.0)
    desk.record("a/new.mcap", 1.0)
    assert desk.gone(desk.retention(keep_days=30.0)) == [old.name]
    assert ahead.exists()


def test_a_file_that_was_written_later_than_its_entry_says_is_not_old(
    desk: Desk, caplog: pytest.LogCaptureFixture
) -> None:
    old = desk.record("a/old.mcap", 50.0)
    os.utime(old, (NOW_S, NOW_S))
    stays(desk, caplog, old, "its file has another date")


def test_too_many_bytes_go_in_the_order_of_recording_whatever_the_clock_said(desk: Desk) -> None:
    desk.record("a/first.mcap", 3.0)
    desk.record("a/second.mcap", 20_500.0)
    desk.record("a/third.mcap", 1.0)
    assert desk.gone(desk.retention(keep_bytes=250)) == ["first.mcap"]


def test_real_records_of_this_boot_are_believed(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "records.jsonl")
    for name in ("a.mcap", "b.mcap"):
        (tmp_path / name).write_bytes(b"x")
        ledger.add(tmp_path / name, moment())
    assert moment().boot
    assert doubts(ledger.entries, moment()) == {}


def test_the_ledger_survives_a_restart_and_a_restart_announces_anew(desk: Desk, tmp_path: Path) -> None:
    desk.record("a/old.mcap", 50.0)
    desk.record("a/new.mcap", 1.0)
    desk.retention(keep_days=30.0).turn()
    desk.clock_s += NOTICE_S
    desk.ledger = Ledger(tmp_path / "records.jsonl")
    announced, removed = desk.retention(keep_days=30.0).turn()
    assert (len(announced), removed) == (1, [])


def test_what_went_stands_in_the_log_though_the_ledger_cannot_be_written(
    desk: Desk, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = desk.record("a/old.mcap", 50.0)
    desk.record("a/new.mcap", 50.0)
    retention = desk.retention(keep_days=30.0)
    retention.turn()
    assert f"retention: {old} goes in 24 h" in caplog.text
    second = desk.record("b/old.mcap", 50.0)
    desk.record("b/new.mcap", 50.0)
    desk.clock_s += NOTICE_S

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(RigError, match=r"records\.jsonl: cannot be written: No space"):
        retention.turn()
    assert f"retention: removed {old} (100 bytes)" in caplog.text
    assert f"retention: {second} goes in 24 h" in caplog.text
    assert second.exists()


@pytest.mark.parametrize(
    "text", ["nonsense", '{"path": 1}\n', "[]\n", '{"path": 1, "device": 1, "inode": 1, "size": 1, "recorded_s": 1}']
)
def test_a_broken_ledger_is_put_aside_and_nothing_is_ours(tmp_path: Path, text: str) -> None:
    (tmp_path / "records.jsonl").write_text(text)
    ledger = Ledger(tmp_path / "records.jsonl")
    assert ledger.entries == []
    assert (tmp_path / "records.jsonl").read_text() == text
    (tmp_path / "a.mcap").write_bytes(b"x")
    ledger.add(tmp_path / "a.mcap", Moment(NOW_S))
    assert (tmp_path / "records.broken").read_text() == text
    assert [entry.path for entry in Ledger(tmp_path / "records.jsonl").entries] == [str(tmp_path / "a.mcap")]


def test_a_ledger_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"x")
    with pytest.raises(RigError, match=r"records.jsonl: cannot be written: No such file"):
        Ledger(tmp_path / "none" / "records.jsonl").add(tmp_path / "a.mcap", Moment(NOW_S))


def test_a_record_that_is_not_there_is_not_written_down(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "records.jsonl")
    ledger.add(tmp_path / "none.mcap", Moment(NOW_S))
    assert ledger.entries == []


def test_a_dry_run_says_what_would_go_and_removes_nothing(desk: Desk, tmp_path: Path) -> None:
    for name in ("a/1.mcap", "a/2.mcap"):
        desk.record(name, 400.0)
    desk.record("a/3.mcap", 20_500.0)
    desk.record("a/4.mcap", 1.0)
    (tmp_path / "d.yaml").write_text(f"state: {tmp_path}\nkeep_days: 30\n")
    done = CliRunner().invoke(daemon, ["--config", str(tmp_path / "d.yaml"), "--dry-run"])
    assert done.exit_code == 0, done.output
    assert f"would go: {desk.logs / 'a' / '1.mcap'}  100 bytes" in done.output
    assert "2 of 4 records of this daemon, 0.000 GB; nothing was removed" in done.output
    assert (
        f"stays: {desk.logs / 'a' / '3.mcap'}  its date is not believed: there was no pamrig on 1970-01-01"
        in done.output
    )
    assert (desk.logs / "a" / "1.mcap").exists()
    done = CliRunner().invoke(daemon, ["--state", str(tmp_path), "--dry-run"])
    assert "retention is off" in done.output


def test_a_month_of_records_costs_the_ledger_no_memory(tmp_path: Path) -> None:
    ledger, files = Ledger(tmp_path / "records.jsonl"), [tmp_path / f"sine_0.5hz_r{n}.mcap" for n in range(700)]
    for file in files:
        file.touch()
    for file in files[:100]:
        ledger.add(file, Moment(1.0))
    tracemalloc.start()
    grown = []
    for start in (100, 300, 500):  # what others in this process keep now and then is not in all of them
        gc.collect()
        before = tracemalloc.get_traced_memory()[0]
        for file in files[start : start + 200]:
            ledger.add(file, Moment(1.0))
        gc.collect()
        grown.append(tracemalloc.get_traced_memory()[0] - before)
    tracemalloc.stop()
    assert len(ledger.entries) == 700
    assert min(grown) / 200 < 20.0, "bytes a record"


def test_a_full_disk_leaves_no_half_line_in_the_ledger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ledger = Ledger(tmp_path / "records.jsonl")
    for name in ("a.mcap", "b.mcap"):
        (tmp_path / name).write_bytes(b"x")
    ledger.add(tmp_path / "a.mcap", Moment(NOW_S))
    opened = Path.open

    class Full:
        def __init__(self, file: Any) -> None:
            self._file = file

        def __enter__(self) -> "Full":
            return self

        def __exit__(self, *_: object) -> None:
            self._file.close()

        def write(self, text: str) -> None:
            self._file.write(text[:20])
            raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", lambda path, *more, **named: Full(opened(path, *more, **named)))
        with pytest.raises(RigError, match="No space left"):
            ledger.add(tmp_path / "b.mcap", Moment(NOW_S))
    assert [entry.path for entry in ledger.entries] == [str(tmp_path / "a.mcap")]
    ledger.add(tmp_path / "b.mcap", Moment(NOW_S))
    assert len(ledger.entries) == 2
