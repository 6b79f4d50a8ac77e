"""A rig that is a recording: which row is shown when, how old it is, and logs that do not fit."""

import math
from pathlib import Path

import pytest

from rig.app.stand_ins.playback import PlaybackRig, PlaybackSettings
from rig.errors import ConfigError, RecordError
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import VirtualClock
from rig.sample import Flag

ANGLE_ONLY = frozenset({Role.VALVE_1, Role.VALVE_2, Role.ANGLE})


def log_with(folder: Path, text: str) -> Path:
    path = folder / "log.csv"
    path.write_text(text)
    return path


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock(start_ns=77)


@pytest.fixture
def rig(tmp_path: Path, clock: VirtualClock) -> PlaybackRig:
    log = log_with(
        tmp_path, "t_s,dp_cmd_mpa,p1_mpa,p2_mpa,angle_deg\n0,0,0.2,0.2,1\n0.005,0,0.21,,2\n0.010,0,0.22,0.18,3\n"
    )
    made = PlaybackRig(PlaybackSettings(log), DeviceContext(clock, frozenset(Role), 0.2, 0.2))
    made.open()
    return made


def test_it_stands_at_its_first_row_until_the_first_write(rig: PlaybackRig, clock: VirtualClock) -> None:
    clock.wait_until_ns(10**9)
    assert (rig.read().angle_deg, rig.read().angle_age_ns) == (1.0, 0)


def test_rows_come_at_their_time_and_say_how_old_they_are(rig: PlaybackRig, clock: VirtualClock) -> None:
    rig.write(0.2, 0.2)
    seen = []
    for _ in range(6):
        now = rig.read()
        seen.append((now.angle_deg, now.angle_age_ns))
        clock.wait_until_ns(clock.now_ns() + 3_000_000)
    assert seen == [(1, 0), (1, 3_000_000), (2, 1_000_000), (2, 4_000_000), (3, 2_000_000), (3, 5_000_000)]


def test_a_missing_value_is_absent(rig: PlaybackRig, clock: VirtualClock) -> None:
    rig.write(0.2, 0.2)
    clock.wait_until_ns(clock.now_ns() + 5_000_000)
    now = rig.read()
    assert math.isnan(now.p2_mpa)
    assert now.flags == Flag.P2_ABSENT
    assert now.p1_mpa == 0.21


def test_a_log_without_pressures_plays_for_a_rig_without_monitors(tmp_path: Path, clock: VirtualClock) -> None:
    log = log_with(tmp_path, "t_s,dp_cmd_mpa,angle_deg\n0,0,1\n0.005,0.1,2\n")
    playing = PlaybackRig(PlaybackSettings(log), DeviceContext(clock, ANGLE_ONLY))
    playing.open()
    assert playing.read().flags == Flag.P1_ABSENT | Flag.P2_ABSENT
    with pytest.raises(ConfigError, match="holds no p1_mpa, which the role monitor_1 needs"):
        PlaybackRig(PlaybackSettings(log), DeviceContext(clock, frozenset(Role))).open()


def test_a_log_that_is_none_is_one_line(tmp_path: Path, clock: VirtualClock) -> None:
    with pytest.raises(RecordError) as caught:
        PlaybackRig(PlaybackSettings(tmp_path / "no.mcap"), DeviceContext(clock, ANGLE_ONLY)).open()
    assert "\n" not in str(caught.value)
