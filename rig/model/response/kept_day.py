"""The records that a fingerprint was made from, packed into a few kilobytes of text: commands as they were, what was
measured up to 12 Hz, each column in whole steps of a third of its noise.

A response model misses what it has no terms for, on every rig something else. Records under a command that is kept here
are compared with what the rig itself answered to it.
"""

import base64
import json
import lzma
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rig.channels import FACT as CHANNELS_FACT
from rig.columns import white_noise
from rig.conditions import conditions
from rig.errors import ModelError
from rig.further_channels import FACT as FURTHER_FACT
from rig.record import Column, Record
from rig.smoothing import filled, thinned

KEPT_PERIOD_S: Final = 0.04
"""Of what was measured. The likelihood judges lines up to 6 Hz. Less: a larger file; more: fast excitations are not
kept."""
COMMAND_STEP: Final = 5e-5
"""Share of a command's span in which it is kept: far less than two runs of one sweep may differ by. Less: a larger
file."""
NOISE_STEP: Final = 1.0 / 3.0
"""Share of a column's white noise (one standard deviation) in which it is kept: adds 4 to 8 % to its variance after
the low-pass where it was sampled every 10 to 5 ms, a third at 1 ms. Less: a larger file."""
LEAST_STEP, MOST_STEP = 1e-5, 5e-4
"""The same as a share of its span, for a column without noise, and for one whose fast part looks like noise."""
MOST_S: Final = 600.0
"""Of all records together: some 60 kB. What comes after is not kept."""
MOST_BYTES: Final = 32 * 1024 * 1024
"""Unpacked; more is no file of ours."""
LINE: Final = 120
"""Characters in a line of the text."""
_COMMANDS: Final = ("dp_cmd_mpa", "p1_cmd_mpa", "p2_cmd_mpa")
_MEASURED: Final = ("p1_mpa", "p2_mpa", "angle_deg")
_WIDTH: Final = 8
"""Bytes of a whole number before they are packed."""
_FACTS: Final = (CHANNELS_FACT, FURTHER_FACT)


def packed(records: Sequence[Record]) -> str:
    """The records as text: of each name and condition the last, whole ones only. Records on a regular grid, time in
    seconds; empty where there is nothing to keep."""
    heads, columns = [], []
    for record in _kept(records):
        head, mine = _head(record)
        heads.append(head)
        columns += mine
    if not heads:
        return ""
    body = b"".join(map(_bytes_of, columns))
    pressed = lzma.compress(json.dumps(heads).encode() + b"\n" + body, preset=6)
    text = base64.b64encode(pressed).decode()
    return "\n".join(text[k : k + LINE] for k in range(0, len(text), LINE)) + "\n"


def unpacked(text: str) -> list[Record]:
    """The records of such a text, rows as far apart as they were; none of an empty one. ModelError when it is none."""
    if not text:
        return []
    try:
        whole = lzma.LZMADecompressor().decompress(base64.b64decode(text), MOST_BYTES)
        heads, _, body = whole.partition(b"\n")
        return list(_records(json.loads(heads), body))
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError, lzma.LZMAError):
        raise ModelError("the records that the model's fingerprint keeps cannot be read") from None


def _kept(records: Sequence[Record]) -> list[Record]:
    """Of each name and condition the last record without holes, while there is room."""
    found = {(each.name, str(conditions(each))): each for each in records if _whole(each)}
    kept, seconds = [], 0.0
    for record in found.values():
        seconds += len(record) * record.period_s
        if seconds <= MOST_S:
            kept.append(record)
    return kept


def _whole(record: Record) -> bool:
    columns = [getattr(record, name) for name in (*_COMMANDS, *_MEASURED)]
    return record.angle_deg is not None and all(bool(np.isfinite(each).all()) for each in columns if each is not None)


def _head(record: Record) -> tuple[dict[str, Any], list[Column]]:
    """What stands before the columns, and the columns in whole steps."""
    apart = max(1, round(KEPT_PERIOD_S / record.period_s))
    steps: dict[str, float] = {}
    whole = []
    for name, column in _beside(record).items():
        span = max(float(np.ptp(record.dp_cmd_mpa if name in _COMMANDS else column)), 1e-9)
        if name in _COMMANDS:
            steps[name] = COMMAND_STEP * span
        else:
            steps[name] = float(np.clip(NOISE_STEP * white_noise([column]), LEAST_STEP * span, MOST_STEP * span))
            column = thinned(column, apart)
        whole.append(np.round(column / steps[name]))
    stated = conditions(record)
    head = {
        "name": record.name,
        "rows": len(record),
        "period_s": record.period_s,
        "apart": apart,
        "steps": steps,
        "facts": stated | {name: record.facts[name] for name in _FACTS if name in record.facts},
        "columns": [name for name in stated if name in record.extra],
    }
    return head, whole


def _beside(record: Record) -> dict[str, Column]:
    """The columns by name; what each valve was commanded less its half of the difference, which mostly stands still."""
    half = 0.5 * record.dp_cmd_mpa
    columns = {"dp_cmd_mpa": record.dp_cmd_mpa}
    if record.p1_cmd_mpa is not None and record.p2_cmd_mpa is not None:
        columns |= {"p1_cmd_mpa": record.p1_cmd_mpa - half, "p2_cmd_mpa": record.p2_cmd_mpa + half}
    measured = {name: getattr(record, name) for name in _MEASURED}
    return columns | {name: column for name, column in measured.items() if column is not None}


def _bytes_of(whole: Column) -> bytes:
    """Second differences of whole numbers, small ones small, byte by byte of all: what packs well."""
    apart = np.diff(whole, n=2, prepend=[0.0, 0.0]).astype(np.int64)
    zigzag: NDArray[np.uint64] = ((apart << 1) ^ (apart >> 63)).astype("<u8")
    return zigzag.view(np.uint8).reshape(-1, _WIDTH).T.tobytes()


def _whole_of(body: bytes, start: int, rows: int) -> Column:
    planes = np.frombuffer(body, np.uint8, _WIDTH * rows, start).reshape(_WIDTH, rows)
    zigzag = planes.T.copy().view("<u8")[:, 0].astype(np.int64)
    apart = (zigzag >> 1) ^ -(zigzag & 1)
    return np.cumsum(np.cumsum(apart)).astype(np.float64)


def _records(heads: Sequence[Mapping[str, Any]], body: bytes) -> Iterator[Record]:
    start = 0
    for head in heads:
        rows, apart = int(head["rows"]), int(head["apart"])
        if not 0 < apart <= rows:
            raise ValueError(apart)
        columns: dict[str, Column] = {}
        for name, step in head["steps"].items():
            count = rows if name in _COMMANDS else -(-rows // apart)
            column = float(step) * _whole_of(body, start, count)
            columns[name] = column if name in _COMMANDS else filled(column, apart, rows)
            start += _WIDTH * count
        half = 0.5 * columns["dp_cmd_mpa"]
        if "p1_cmd_mpa" in columns:
            columns |= {"p1_cmd_mpa": columns["p1_cmd_mpa"] + half, "p2_cmd_mpa": columns["p2_cmd_mpa"] - half}
        facts = dict(head["facts"])
        extra = {name: np.full(rows, float(facts.pop(name))) for name in head["columns"]}
        by_name: dict[str, Any] = dict(columns)
        time = float(head["period_s"]) * np.arange(rows, dtype=np.float64)
        yield Record(str(head["name"]), time, extra=extra, facts=facts, **by_name)
