"""A daemon of real processes: an operator's day, what he does wrong, and restarts."""

import json
import os
import shutil
import signal
import threading
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil.faults import Injection
from rig.cli.service import daemon as cli_daemon
from rig.errors import RigError, StateError
from rig.qualify.faults.bench import SAFE_MPA, FaultBench
from rig.realtime.ring import Ring
from rig.realtime.shared import KEPT_RING
from rig.realtime.shared import folder as shared_folder
from rig.service.client import Client
from rig.service.records.blackbox import Owner
from rig.service.records.durable_file import DurableFile
from rig.service.records.ledger import Ledger

pytest_plugins = "support.rigs.daemon_rig"


def pressures(client: Client) -> tuple[float, float]:
    """Measured now, MPa."""
    sample = client.status()["loop"]
    return sample["p1_mpa"], sample["p2_mpa"]


# an operator's day


def test_arm_start_two_sweeps_with_a_pause_and_disarm(bench: FaultBench, client: Client) -> None:
    client.arm()
    assert client.status()["state"] == "armed"
    jobs = client.start(bench.folder / "short.yaml", bench.folder / "short.yaml", pause_s=0.2)
    assert [job["records"] for job in jobs] == [2, 2]
    seen = []
    while (status := client.status())["working"]:
        seen.append(status["left_s"])
        time.sleep(0.02)
    assert seen[0] > 2.0
    assert seen[-1] < 1.0
    done = [job for job in status["queue"] if job["id"] in [job["id"] for job in jobs]]
    assert [(job["state"], job["done"]) for job in done] == [("done", 2), ("done", 2)]
    files = [Path(file) for job in done for file in job["files"]]
    assert len(set(files)) == 4
    assert all(file.stat().st_size > 1000 for file in files)
    assert {str(file) for file in files} <= {
        entry.path for entry in Ledger(DurableFile(bench.state / "records.jsonl")).entries
    }
    assert status["state"] == "done"
    client.stop()
    assert client.status()["state"] == "disarmed"


def test_stop_ramps_down_and_start_goes_on_with_the_record_that_was_not_finished(
    bench: FaultBench, client: Client
) -> None:
    client.arm()
    client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    client.stop()
    status = client.wait()
    assert status["state"] == "done"
    assert [job["state"] for job in status["queue"]][-1] == "stopped"
    client.start()
    bench.wait(lambda: client.status()["record"], "the same record again")
    client.stop()
    client.wait()


def test_after_an_emergency_stop_a_new_sweep_asks_before_the_old_queue_moves(bench: FaultBench, client: Client) -> None:
    client.arm()
    (old,) = client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    client.estop()
    bench.wait(lambda: client.status()["fault"], "the fault")
    bench.wait(lambda: not client.status()["working"], "the queue runner to hold")
    client.reset()
    assert any("the queue holds 1 sweep of before: long (1 of 1 record); 1 record" in line for line in client.arm())
    short = bench.folder / "short.yaml"
    with pytest.raises(StateError, match=r"the queue holds 1 sweep of before: long .*`pamrig start --only` leaves it"):
        client.start(short)
    assert not client.status()["working"]
    (new,) = client.start(short, before="leave")
    states = {job["id"]: job["state"] for job in client.wait()["queue"]}
    assert (states[old["id"]], states[new["id"]]) == ("stopped", "done")
    (third,) = client.start(short, before="first")
    status = bench.wait(lambda: (now := client.status())["record"] and now, "the old sweep again")
    assert status["record"]["name"].startswith("sine_0.5hz")
    assert {job["id"]: job["state"] for job in status["queue"]}[third["id"]] == "waiting"
    client.stop()
    client.wait()


def test_a_device_that_is_lost_after_an_emergency_stop_is_opened_anew_by_a_reset(
    bench: FaultBench, client: Client
) -> None:
    """Who stops a rig may also switch it off: no reset was taken any more, for the fault that stood was another."""
    client.estop()
    bench.inject(Injection.LOST)
    bench.wait(lambda: client.status()["loop"]["p1_mpa"] is None, "the loop to lose the device")
    bench.inject(Injection.NONE)
    assert bench.fault() == "ESTOP"
    client.reset()
    assert client.status()["state"] == "disarmed"


def test_of_two_resets_at_once_one_is_carried_out(bench: FaultBench, client: Client) -> None:
    """Both waited for the record that the fault had ended, and then each opened the rig anew; while the second did,
    nobody knew that a reset was under way."""
    client.arm()
    client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    at_once, said = threading.Barrier(2), list[str]()

    def reset() -> None:
        with bench.client() as one:
            at_once.wait()
            try:
                one.reset()
                said.append("")
            except RigError as error:
                said.append(str(error))

    both = [threading.Thread(target=reset) for _ in range(2)]
    bench.inject(Injection.LOST)
    bench.wait(bench.fault, "the fault")
    bench.inject(Injection.NONE)
    for each in both:
        each.start()
    for each in both:
        each.join()
    assert said.count("") == 1
    assert client.status()["state"] == "disarmed"


def test_while_the_rig_ramps_down_and_while_one_sweep_is_made_alone_an_old_queue_asks_too(
    bench: FaultBench, client: Client
) -> None:
    client.arm()
    short, asks = bench.folder / "short.yaml", r"the queue holds 1 sweep of before: long"
    (old,) = client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    client.stop()
    with pytest.raises(StateError, match=asks):
        client.start(short)
    (new,) = client.start(short, before="leave")
    with pytest.raises(StateError, match=asks):
        client.start(short)
    (more,) = client.start(short, before="leave")
    status = client.wait()
    jobs = {job["id"]: (job["state"], job["error"]) for job in status["queue"]}
    assert [jobs[one["id"]] for one in (old, new, more)] == [("stopped", ""), ("done", ""), ("done", "")]
    assert status["left_s"] > 60.0, "of the whole queue again"


def test_start_and_queue_say_what_moves_and_how_it_ended(bench: FaultBench, client: Client) -> None:
    client.arm()
    short, call = str(bench.folder / "short.yaml"), CliRunner().invoke
    done = call(cli_daemon.start, [short, "--wait", "--socket", str(bench.socket)])
    (made,) = client.status()["queue"][-1:]
    assert done.exit_code == min(made["not_valid"], 1), "a busy machine misses a tick now and then"
    assert "short: done, 2 of 2 records" in done.output
    client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    client.stop()
    client.wait()
    shown = call(cli_daemon.queue, ["--socket", str(bench.socket)]).output
    assert "long" in shown
    assert "; held: `pamrig start` goes on" in shown
    refused = call(cli_daemon.start, [short, "--socket", str(bench.socket)])
    assert isinstance(refused.exception, StateError)
    on = call(cli_daemon.start, ["--socket", str(bench.socket)])
    assert on.output.startswith("going on with the queue: long (1 of 1 record); 60 s"), on.output
    bench.wait(lambda: client.status()["record"], "the record")
    client.stop()
    client.wait()


def test_stop_after_the_current_record(bench: FaultBench, client: Client) -> None:
    client.arm()
    (job,) = client.start(bench.folder / "short.yaml")
    bench.wait(lambda: client.status()["record"], "the record")
    client.stop(after_current=True)
    status = client.wait()
    (left,) = [one for one in status["queue"] if one["id"] == job["id"]]
    assert (left["state"], left["done"]) == ("stopped", 1)


def test_arming_moves_nothing(bench: FaultBench, client: Client) -> None:
    """Arming holds the measured pressures, which have come to the safe values after a while."""
    bench.wait(lambda: pressures(client) == pytest.approx(SAFE_MPA, abs=0.002), "the muscles to come to rest")
    before = bench.terminals.setpoints
    client.arm()
    time.sleep(0.1)
    assert bench.terminals.setpoints == pytest.approx(before, abs=0.003)


def test_after_an_emergency_stop_nothing_goes_before_a_reset_and_a_reset_does_not_arm(
    bench: FaultBench, client: Client
) -> None:
    client.estop()
    bench.wait(lambda: client.status()["fault"], "the fault")
    for command in (client.arm, lambda: client.start(bench.folder / "short.yaml"), client.stop):
        with pytest.raises(StateError, match=r"while fault: ESTOP; run `pamrig reset` first"):
            command()
    client.reset()
    assert client.status()["state"] == "disarmed"
    assert bench.terminals.setpoints == SAFE_MPA


# bad input: one clear answer each, the rig unmoved


def test_wrong_states_say_what_to_do(bench: FaultBench, client: Client) -> None:
    writes = bench.terminals.changed_ns
    with pytest.raises(StateError, match=r"cannot start while disarmed; run `pamrig arm` first"):
        client.start(bench.folder / "short.yaml")
    with pytest.raises(StateError, match="nothing to reset: the rig is disarmed"):
        client.reset()
    with pytest.raises(StateError, match="nothing to stop: nothing runs, and the rig is disarmed"):
        client.stop()
    assert bench.terminals.changed_ns == writes
    client.arm()
    with pytest.raises(StateError, match=r"armed already; `pamrig start` begins"):
        client.arm()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "records: [{sine: {frequency_hz: 1, amplitude_mpa: 0.9}}]",
            "^bad.yaml: sine_1hz_0.90mpa: set-point p2 would be",
        ),
        ("records: [{sin: {}}]", "expected one signal; did you mean 'sine'"),
        ("records: [", "not valid YAML"),
    ],
)
def test_a_sweep_that_does_not_fit_is_refused_whole(bench: FaultBench, client: Client, text: str, message: str) -> None:
    (bench.folder / "bad.yaml").write_text(text)
    client.arm()
    with pytest.raises(RigError, match=message):
        client.start(bench.folder / "short.yaml", bench.folder / "bad.yaml")
    status = client.status()
    assert status["state"] == "armed"
    assert not status["working"]


# restarts


def test_a_restart_comes_back_disarmed_and_remembers_what_was_done(bench: FaultBench, client: Client) -> None:
    client.arm()
    (done,) = client.start(bench.folder / "short.yaml")
    client.wait()
    (cut,) = client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    client.close()
    assert bench.end() == 0
    assert bench.terminals.setpoints == SAFE_MPA
    bench.socket.write_text("")  # a stale file where the socket was
    bench.start()
    status = bench.status()
    jobs = {job["id"]: job for job in status["queue"]}
    assert (status["state"], status["working"]) == ("disarmed", False)
    assert (jobs[done["id"]]["state"], len(jobs[done["id"]]["files"])) == ("done", 2)
    assert jobs[cut["id"]]["state"] in ("stopped", "failed")
    assert not list(bench.state.glob("*.broken"))


def test_a_daemon_that_is_killed_in_the_first_record_knows_where_that_lies(bench: FaultBench, client: Client) -> None:
    """A job's folder was written down with its first whole record: the next try had another one, and what the kill had
    left of the first was in a folder of no job."""
    client.arm()
    (job,) = client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    folder = Path(next(one for one in client.status()["queue"] if one["id"] == job["id"])["folder"])
    client.close()
    bench.send("control", signal.SIGKILL)
    bench.wait(lambda: not bench.alive, "its end")
    bench.start()
    (known,) = [one for one in bench.status()["queue"] if one["id"] == job["id"]]
    assert (known["state"], Path(known["folder"])) == ("stopped", folder)
    assert folder.is_dir()


def test_a_state_folder_that_is_away_for_a_while_loses_nothing(bench: FaultBench, client: Client) -> None:
    """The black box made a folder at its place, into which the queue went: the one that was moved could not come back.
    Nobody said anything of it."""
    client.arm()
    client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    begun = len(bench.log_text())
    away = bench.state.rename(bench.folder / "away")
    try:
        bench.wait(lambda: "the daemon's state folder was moved" in bench.log_text()[begun:], "the daemon to say so")
        client.estop()
        bench.wait(lambda: "black box could not be written, and is tried again" in bench.log_text()[begun:], "the box")
        assert (client.status()["fault"]["name"], bench.is_safe, bench.state.exists()) == ("ESTOP", True, False)
    finally:
        away.rename(bench.state)
    bench.wait(lambda: any("estop" in box for box in client.status()["black_boxes"]), "the black box")

    def kept() -> str:
        jobs = json.loads((bench.state / "queue.json").read_text())["jobs"]
        return str([job["state"] for job in jobs if job["name"] == bench.sweep.stem][-1])

    bench.wait(lambda: kept() == "stopped", "the queue")  # written anew when the folder is looked at the next time


def test_a_daemon_whose_state_folder_was_removed_leaves_its_black_box_to_the_next(
    bench: FaultBench, client: Client
) -> None:
    """The ring of its session went on to name the folder of before: the next daemon took it for another's."""
    client.arm()
    client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    ring = Ring.attach(shared_folder() / f"pamrig-{client.status()['session']}{KEPT_RING}")
    shutil.rmtree(bench.state)
    bench.wait(lambda: bench.state.exists() and Owner.read(ring).folder == Owner.of(bench.state, "").folder, "its name")
    client.close()
    bench.send("control", signal.SIGKILL)
    bench.wait(lambda: not bench.alive, "its end")
    bench.start()
    assert [box for box in bench.status()["black_boxes"] if Path(box).exists()]


def test_ended_daemons_leave_no_shared_memory(bench: FaultBench) -> None:
    bench.at_rest()
    session = bench.status()["session"]
    bench.end()
    assert not [name for name in os.listdir("/dev/shm") if session in name]
    bench.at_rest()  # and there is another
