"""The mailbox of an I/O process: notes, texts, and whose it is."""

import os
from pathlib import Path

import pytest
from support.own_mailbox import own_mailbox

from drivers.io_process import mailbox as mailboxes
from drivers.io_process.mailbox import IoMailbox, LinkState, OutputsMode, Report, Trip
from rig.errors import DeviceLost


@pytest.fixture
def box(tmp_path: Path) -> IoMailbox:
    return own_mailbox(tmp_path)


def test_notes_arrive_whole_and_the_newest_replaces_the_rest(box: IoMailbox) -> None:
    assert box.order().mode is OutputsMode.NONE
    for number in range(1, 6):
        assert box.post_order(10 * number, OutputsMode.DRIVE, (1.5, float(number))) == number
    assert box.order() == (5, 50, OutputsMode.DRIVE, (1.5, 5.0))
    report = Report(
        7,
        LinkState.DOWN,
        Trip.OUTAGE,
        1,
        2,
        3,
        4,
        5,
        6,
        7,
        (0.5,) * 8,
        tuple(range(8)),
        True,
        "the line is gone \u00b5s",
    )
    box.post_report(report)
    assert box.report() == report


def test_a_torn_note_is_never_believed(box: IoMailbox) -> None:
    """Every byte of the current slot in turn: the reader keeps to what it had."""
    box.post_order(1, OutputsMode.SAFE, (1.0,))
    before = box.order()
    number = box.order_note.number[0]
    at = box.order_note.slots[number & 1]
    for offset in range(box.order_note.layout.size + 12):
        box.view[at + offset] ^= 0x40
        assert box.order() == before
        box.view[at + offset] ^= 0x40
    assert box.order() == before


def test_long_texts_are_cut_not_spilled(box: IoMailbox) -> None:
    box.post_report(Report(text="x" * 5000))
    assert set(box.report().text) == {"x"}


def test_one_owner_at_a_time_and_others_find_it(tmp_path: Path) -> None:
    path = tmp_path / "box"
    assert mailboxes.attach(path) is None
    descriptor = mailboxes.create(path)
    assert descriptor is not None
    own = mailboxes.mapped(path)
    assert mailboxes.create(path) is None
    other = mailboxes.attach(path)
    assert other is not None
    other.raise_alarm()
    assert own.alarm == 1
    mailboxes.remove(path)
    assert path.exists(), "somebody lives behind it"
    os.close(descriptor)
    assert mailboxes.attach(path) is None, "its owner is gone"
    mailboxes.remove(path)
    assert not path.exists()


def test_a_mailbox_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(DeviceLost, match="the mailbox of an I/O process cannot be made: No such file"):
        mailboxes.create(tmp_path / "none" / "box")
