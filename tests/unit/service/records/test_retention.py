"""Retention: off by itself, and never anything but announced records of the daemon's own ledger."""

import errno
import json
import os
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from rig.app import shipped
from rig.cli.service.daemon import daemon
from rig.errors import RigError
from rig.service.aside import DiskWork
from rig.service.records.durable_file import DurableFile
from rig.service.records.ledger import Ledger
from rig.service.records.operating_time import OperatingTime
from rig.service.records.retention import NOTICE_S, Policy, Retention
from rig.service.settings import DaemonSettings, load_settings

DAY_S = 86400.0
RUN_S = 4000 * DAY_S
"""The daemon has run for so long."""


class Desk:
    """A folder of logs, a ledger and a clock that is turned by hand."""

    def __init__(self, folder: Path) -> None:
        self.logs, self.clock_s, self._recorded_s = folder / "logs", 0.0, 0.0
        self.operating = OperatingTime(DurableFile(folder / "operating_time.json"), lambda: self.clock_s)
        self.clock_s = RUN_S
        self.ledger = Ledger(DurableFile(folder / "records.jsonl"), lambda: self._recorded_s)

    def record(self, name: str, age_days: float = 1.0, size: int = 100, *, own: bool = True) -> Path:
        """A record under the logs, in the ledger when it is the daemon's `own`."""
        path = self.logs / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(bytes(size))
        self._recorded_s = RUN_S - age_days * DAY_S
        if own:
            self.ledger.add(path)
        return path

    def retention(self, keep_bytes: int | None = None, keep_days: float | None = None) -> Retention:
        keep_s = None if keep_days is None else keep_days * DAY_S
        return Retention(self.ledger, Policy(keep_bytes, keep_s), self.operating, DiskWork())

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
    assert [entry.path for entry in Ledger(DurableFile(old.parents[2] / "records.jsonl")).entries] == [str(new)]


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
    old, other = desk.record("a/old.mcap", 50.0), desk.record("a/other.mcap", 40.0)
    desk.record("a/new.mcap", 1.0)
    retention = desk.retention(keep_bytes=250)
    assert [Path(entry.path) for entry in retention.turn()[0]] == [old]
    other.unlink()
    desk.clock_s += NOTICE_S
    assert retention.turn() == ([], [])
    desk.record("a/newest.mcap", 0.0)
    announced, removed = retention.turn()
    assert ([Path(entry.path) for entry in announced], removed) == ([old], [])
    assert old.exists()


# how old a record is


def test_a_wall_clock_that_is_years_ahead_makes_nothing_old(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    records = [desk.record(f"a/{number}.mcap", 1.0) for number in (1, 2)]
    ahead_s = time.time() + 12 * 365 * DAY_S
    monkeypatch.setattr("time.time", lambda: ahead_s)
    records.append(desk.record("a/3.mcap", 0.5))
    assert desk.gone(desk.retention(keep_days=30.0)) == []
    assert all(path.exists() for path in records)


def test_a_record_is_as_old_as_the_daemon_has_run_since_whatever_the_wall_clock_says(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("time.time", lambda: 20_500.0)  # 1970, as on a small machine before it has a network
    old = desk.record("a/old.mcap", 0.0)
    desk.record("a/new.mcap", 0.0)
    retention = desk.retention(keep_days=30.0)
    desk.clock_s += 30 * DAY_S
    assert retention.turn() == ([], [])
    desk.clock_s += 1.0
    assert [Path(entry.path) for entry in retention.turn()[0]] == [old]


def test_operating_time_is_that_of_all_starts_and_nothing_between_them(tmp_path: Path) -> None:
    path, clock = tmp_path / "operating_time.json", [5000.0]
    for expected_s in (100.0, 200.0):
        operating = OperatingTime(DurableFile(path), lambda: clock[0])
        clock[0] += 100.0
        operating.save()
        assert operating.s() == expected_s
        clock[0] += 9e6  # the machine is off


@pytest.mark.parametrize("text", ["", "nonsense", "[]", "{}", '{"operating_s": NaN}', '{"operating_s": -1}'])
def test_a_broken_operating_time_begins_anew_and_makes_nothing_old(tmp_path: Path, text: str) -> None:
    (tmp_path / "operating_time.json").write_text(text)
    begun = OperatingTime(DurableFile(tmp_path / "operating_time.json"), lambda: 7.0)
    assert begun.s() == 0.0
    assert not (tmp_path / "operating_time.broken").exists()  # who merely looks changes nothing
    begun.save()
    assert (tmp_path / "operating_time.broken").read_text() == text
    assert OperatingTime(DurableFile(tmp_path / "operating_time.json"), lambda: 7.0).s() == 0.0
    ledger = Ledger(DurableFile(tmp_path / "records.jsonl"), lambda: 400 * DAY_S)
    for name in ("a.mcap", "b.mcap"):
        (tmp_path / name).write_bytes(b"x")
        ledger.add(tmp_path / name)
    assert Policy(keep_s=DAY_S).due(ledger.entries, 0.0) == []


def test_an_operating_time_that_cannot_be_written_says_so_and_rooms_are_made_all_the_same(
    desk: Desk, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with pytest.raises(RigError, match=r"operating_time.json: cannot be written: No such file"):
        OperatingTime(DurableFile(tmp_path / "none" / "operating_time.json")).save()
    retention = Retention(
        desk.ledger, Policy(), OperatingTime(DurableFile(tmp_path / "none" / "operating_time.json")), DiskWork()
    )
    retention.remember()
    assert "operating_time.json: cannot be written" in caplog.text


def test_records_of_a_ledger_without_operating_times_grow_old_from_now_on(tmp_path: Path) -> None:
    lines = []
    for name in ("a.mcap", "b.mcap"):
        (tmp_path / name).write_bytes(b"x")
        seen = (tmp_path / name).stat()
        known = {"path": str(tmp_path / name), "device": seen.st_dev, "inode": seen.st_ino, "size": 1}
        lines.append(json.dumps(known | {"recorded_s": 1.7e9, "boot": "of before", "up_s": 60.0}) + "\n")
    (tmp_path / "records.jsonl").write_text("".join(lines))
    entries, policy = Ledger(DurableFile(tmp_path / "records.jsonl")).entries, Policy(keep_s=30 * DAY_S)
    assert len(entries) == 2
    assert policy.due(entries, 30 * DAY_S) == []
    assert [Path(entry.path).name for entry in policy.due(entries, 30 * DAY_S + 1.0)] == ["a.mcap"]


def test_a_file_that_somebody_wrote_to_is_his(desk: Desk) -> None:
    old = desk.record("a/old.mcap", 50.0)
    desk.record("a/new.mcap", 1.0)
    then = old.stat().st_mtime
    os.utime(old, (then + 1.9,) * 2)  # what FAT makes of it
    assert desk.ledger.entries[0].ours
    os.utime(old, (then + 60.0,) * 2)
    assert desk.gone(desk.retention(keep_bytes=0, keep_days=30.0)) == []
    assert old.exists()


def test_too_many_bytes_go_in_the_order_of_recording(desk: Desk) -> None:
    desk.record("a/first.mcap", 3.0)
    desk.record("a/second.mcap", 3000.0)
    desk.record("a/third.mcap", 1.0)
    assert desk.gone(desk.retention(keep_bytes=250)) == ["first.mcap"]


def test_the_ledger_survives_a_restart_and_a_restart_announces_anew(desk: Desk, tmp_path: Path) -> None:
    desk.record("a/old.mcap", 50.0)
    desk.record("a/new.mcap", 1.0)
    desk.retention(keep_days=30.0).turn()
    desk.clock_s += NOTICE_S
    desk.ledger = Ledger(DurableFile(tmp_path / "records.jsonl"))
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


def test_a_dry_run_says_what_would_go_and_removes_nothing(desk: Desk, tmp_path: Path) -> None:
    for name in ("a/1.mcap", "a/2.mcap"):
        desk.record(name, 400.0)
    desk.record("a/3.mcap", 20.0)
    desk.record("a/4.mcap", 1.0)
    desk.operating.save()
    (tmp_path / "d.yaml").write_text(f"state: {tmp_path}\nkeep_days: 30\n")
    done = CliRunner().invoke(daemon, ["--config", str(tmp_path / "d.yaml"), "--dry-run"])
    assert done.exit_code == 0, done.output
    assert f"would go: {desk.logs / 'a' / '1.mcap'}  100 bytes" in done.output
    assert "2 of 4 records of this daemon, 0.000 GB; nothing was removed" in done.output
    assert "400.0 days of the daemon's running ago" in done.output
    assert (desk.logs / "a" / "1.mcap").exists()
    done = CliRunner().invoke(daemon, ["--state", str(tmp_path), "--dry-run"])
    assert "retention is off" in done.output
