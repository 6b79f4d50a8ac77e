"""The live view: a Foxglove WebSocket server in a process of its own that reads the ring like any other reader. Needs
the extra `live`.

It listens on this machine's loopback only: Foxglove's protocol knows no token. From elsewhere, an SSH tunnel leads
there.
"""

import asyncio
import logging
import multiprocessing
import os
import signal
import time
from concurrent.futures import Executor
from contextlib import suppress
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Final

from rig.errors import RigError, StateError
from rig.log.mcap import schema
from rig.realtime.faults import explain
from rig.realtime.ring import Ring, RingReader
from rig.sample import unpack
from rig.service.processes import RestartDelays, is_stopped, start_process
from rig.service.session.session import Session

HOST: Final = "127.0.0.1"
LIVE_LOOK_S: Final = 1.0
"""From one look at the process to the next, s."""
LIVE_AGAIN_S: Final = (0.0, 2.0, 10.0, 60.0)
"""Before one that died is replaced for the first, second ... time in a row, as where somebody else has its port."""
_POLL_S: Final = 0.02
_NICE: Final = 10
"""Behind everything else of a session: who looks loses samples, nobody else does."""
_LOG = logging.getLogger("pamrig")


def check_available() -> None:
    """RigError when the extra is not installed."""
    try:
        import foxglove  # noqa: F401
    except ModuleNotFoundError:
        raise RigError("live: needs the extra `live`: pip install 'pamrig[live]'") from None


class LiveView:
    """Starts the server's process for each session; port 0: never."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._process: BaseProcess | None = None
        self._session: Session | None = None
        self._pauses = RestartDelays(LIVE_AGAIN_S, deaths=-1)

    def follow(self, session: Session | None) -> None:
        """Show this session instead of the one before. Blocks, as `close` does, until that one's process has ended."""
        self.close()
        self._session = session
        self._pauses.began()
        if self._port and session is not None:
            arguments = (session.ring.block.path, session.id, self._port, os.getpid())
            process = multiprocessing.get_context("spawn").Process(
                target=show, args=arguments, name="pamrig-live", daemon=True
            )
            start_process(process)  # one that never began cannot be ended
            self._process = process

    async def watch(self, starter: Executor) -> None:
        """Replace a process that has ended or was stopped, by `starter`, where `follow` is called too; never ends."""
        while True:
            await asyncio.sleep(LIVE_LOOK_S)
            if problem := self._lost():
                pause_s = self._pauses.next_s()
                _LOG.warning("live view: %s; started again", problem)
                await asyncio.sleep(pause_s)
                await asyncio.get_running_loop().run_in_executor(starter, self._replace)

    def _lost(self) -> str:
        """Why the process shows nothing any more; empty while it does, and where there is nothing to show."""
        process = self._process
        if process is None:
            return ""
        if not process.is_alive():
            return f"its process has ended with status {process.exitcode}"
        return "its process was stopped" if is_stopped(process.pid) else ""

    def _replace(self) -> None:
        if self._lost():  # still: meanwhile there may be another session
            self.follow(self._session)

    def close(self) -> None:
        """End the process, at once: it has nothing to finish, and may have been stopped."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.join()


def show(ring_path: Path, session: int, port: int, parent: int) -> None:
    """Entry of the live view's process: every sample to whoever looks, until the daemon is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(OSError):
        os.nice(_NICE)
    try:
        ring = Ring.attach(ring_path, session)  # before the import, which takes longer than a session may last
    except StateError:
        return  # a reset ended it while this process began; the session after it is shown by a process of its own
    import foxglove

    reader = RingReader(ring)
    server = foxglove.start_server(name="pamrig", host=HOST, port=port)
    message_schema = foxglove.Schema(
        name=schema.SAMPLE_SCHEMA, encoding="protobuf", data=schema.sample_descriptor_set()
    )
    samples = foxglove.Channel(schema.SAMPLE_TOPIC, schema=message_schema, message_encoding="protobuf")
    log_schema = foxglove.Schema(name=schema.LOG_SCHEMA, encoding="jsonschema", data=schema.log_json_schema())
    lines = foxglove.Channel(schema.LOG_TOPIC, schema=log_schema, message_encoding="json")
    offset_ns = time.time_ns() - time.monotonic_ns()
    fault = 0
    try:
        while os.getppid() == parent:
            for packed in reader:
                sample = unpack(packed)
                at_ns = sample.scheduled_ns + offset_ns
                samples.log(packed, log_time=at_ns)
                if sample.fault != fault and sample.fault:
                    lines.log(schema.log_message("fatal", explain(sample.fault), at_ns), log_time=at_ns)
                fault = sample.fault
            time.sleep(_POLL_S)
    finally:
        server.stop()
