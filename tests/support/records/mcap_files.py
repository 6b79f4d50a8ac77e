"""What an MCAP file of ours holds, read by the `mcap` package alone, so that tests do not trust the code under test."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.reader import make_reader

from rig.sample import Sample, unpack


@dataclass
class Contents:
    """Everything of interest in one file."""

    samples: list[Sample]
    lines: list[str]
    """Messages on /log."""
    run: dict[str, str]
    result: dict[str, str]
    attachments: dict[str, bytes]
    log_times_ns: list[int]


def contents(path: Path) -> Contents:
    """The whole file."""
    with path.open("rb") as file:
        reader = make_reader(file)
        samples: list[Sample] = []
        times: list[int] = []
        lines: list[str] = []
        for _, channel, message in reader.iter_messages():
            if channel.topic == "/rig/sample":
                samples.append(unpack(message.data))
                times.append(message.log_time)
            elif channel.topic == "/log":
                lines.append(json.loads(message.data)["message"])
        metadata: dict[str, Any] = {record.name: record.metadata for record in reader.iter_metadata()}
        attached = {item.name: item.data for item in reader.iter_attachments()}
    return Contents(samples, lines, metadata["pamrig.run"], metadata.get("pamrig.result", {}), attached, times)
