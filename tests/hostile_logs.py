"""Files made to hang, fill or break a reader of logs, by a seed; and what every way to read one must do with it.

    python tests/hostile_logs.py --seconds 3600 --seed 1

makes and reads such files for an hour, in a process that is watched: each file has a time of its own, in proportion to
its size. A file that breaks the rules stays in the folder that is printed.
"""

import json
import random
import struct
import sys
import time
import unicodedata
import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import zstandard
from click.testing import CliRunner
from support import hostile_work
from support.records.made_logs import made_content, made_log

from rig.cli.commands import cli
from rig.errors import RigError
from rig.log.check import check
from rig.log.convert import read_content, write_content
from rig.log.mcap import schema
from rig.log.mcap.framing import MAGIC
from rig.log.mcap.reader import read_stretch
from rig.log.reader import read
from rig.log.recover import recover

ALLOWED_S = 30.0
"""Processor time for all ways to read one small file together, on a machine that does other work too."""
ALLOWED_S_A_MB = 30.0

Pieces = list[bytes]


def allowed_s(size: int) -> float:
    """Seconds of processor time that a file of `size` bytes may take."""
    return ALLOWED_S + ALLOWED_S_A_MB * size / 1e6


def record(opcode: int, body: bytes, length: int | None = None) -> bytes:
    """One record of an MCAP file."""
    return struct.pack("<BQ", opcode, len(body) if length is None else length) + body


def text(value: str) -> bytes:
    """A string as the format has it."""
    return struct.pack("<I", len(value.encode())) + value.encode()


def chunk(
    data: bytes, compression: str = "", packed: bytes | None = None, size: int | None = None, crc: int | None = None
) -> bytes:
    """A chunk of records, by default a sound one."""
    packed = data if packed is None else packed
    head = struct.pack(
        "<QQQI", 0, 1 << 62, len(data) if size is None else size, zlib.crc32(data) if crc is None else crc
    )
    return record(6, head + text(compression) + struct.pack("<Q", len(packed)) + packed)


def squeezed(data: bytes) -> bytes:
    """A chunk compressed as the recorder does it."""
    return chunk(data, "zstd", zstandard.compress(data))


def message(channel: int, data: bytes, length: int | None = None, at: int = 0) -> bytes:
    """One message."""
    return record(5, struct.pack("<HIQQ", channel, 0, at, at) + data, length)


def definitions(
    topic: str = schema.SAMPLE_TOPIC, channel: int = 1, kind: int = 1, described: bytes | None = None
) -> bytes:
    """A schema and a channel of samples."""
    described = schema.sample_descriptor_set() if described is None else described
    held = record(
        3,
        struct.pack("<H", kind)
        + text(schema.SAMPLE_SCHEMA)
        + text("protobuf")
        + struct.pack("<I", len(described))
        + described,
    )
    return held + record(4, struct.pack("<HH", channel, kind) + text(topic) + text("protobuf") + struct.pack("<I", 0))


def end(data: bytes) -> bytes:
    """The end of a file without a summary."""
    return data + record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + MAGIC


def stuck_chunk(draw: random.Random) -> bytes:
    """Messages of a channel of no interest, the last of which is broken: passing over it comes to where it began."""
    broken = draw.choice(
        [message(9, b"", length=draw.choice([0, 5, 21, 1 << 40])), message(9, b"12", length=200), b"\x05" + bytes(30)]
    )
    before = draw.choice([b"", definitions(), record(0x90, b"private"), message(9, b"ok") * draw.randrange(5)])
    return before + broken


def redefined(draw: random.Random) -> bytes:
    """Channels that are defined again before every message."""
    count = draw.choice([10, 1000, 20_000])
    return b"".join(
        definitions(channel=1 + n % 3, described=None if n == 0 else b"") if n == 0 else again(n) for n in range(count)
    )


def again(number: int) -> bytes:
    """A channel once more, and a message in it."""
    held = record(
        4, struct.pack("<HH", 1 + number % 500, 1) + text(schema.SAMPLE_TOPIC) + text("protobuf") + struct.pack("<I", 0)
    )
    return held + message(1 + number % 500, b"")


def hostile(draw: random.Random) -> bytes:
    """One file built against the reader."""
    makers: list[Callable[[random.Random], bytes]] = [
        lambda d: chunk(stuck_chunk(d)),
        lambda d: squeezed(stuck_chunk(d)),
        lambda d: squeezed(redefined(d)),
        lambda d: squeezed(definitions() + message(1, b"") * d.choice([1, 1000, 200_000])),
        lambda d: squeezed(
            b"".join(message(d.choice([1, 2, 9]), b"\x09" + bytes(8)) for _ in range(d.choice([10, 5000])))
        ),
        lambda d: squeezed(
            definitions("/log") + b"".join(message(1, json.dumps(["[" * 500, n]).encode()) for n in range(2000))
        ),
        lambda d: record(15, struct.pack("<I", 0)) * d.choice([2, 20_000]),
        lambda d: record(2, struct.pack("<QQI", 0, 0, 0)) * d.choice([2, 20_000]),
        lambda d: (
            (b"\x09" + struct.pack("<Q", d.choice([100, 200_000])) + bytes(16) + b"\x05\0\0\0") * d.choice([5, 20_000])
        ),
        lambda d: (
            (b"\x0c" + struct.pack("<Q", d.choice([60, 300_000])) + b"\x0a\0\0\0pamrig.run") * d.choice([5, 20_000])
        ),
        lambda d: (
            (b"\x06" + struct.pack("<Q", d.choice([60, 300_000])) + bytes(28) + b"\x04\0\0\0zstd")
            * d.choice([5, 20_000])
        ),
        lambda d: (
            (b"\x06" + struct.pack("<Q", 300_000) + bytes(16) + struct.pack("<QI", 1 << 23, 1) + b"\0\0\0\0")
            * d.choice([5, 9000])
        ),
        lambda d: record(3, bytes(d.randrange(40)) + b"\xff" * 8) * d.choice([1, 9]),
        lambda d: record(12, text("pamrig.run") + struct.pack("<I", 1 << 31) + text("a") * d.choice([3, 50_000])),
        lambda d: record(
            12,
            text("pamrig.run")
            + entries({"a": "[" * d.choice([10, 100_000]), "p0_mpa": "1" * 5000, "started_ns": "NaN"}),
        ),
    ]
    pieces = b"".join(draw.choice(makers)(draw) for _ in range(draw.choice([1, 1, 2, 5])))
    whole = MAGIC + pieces
    return end(whole) if draw.random() < 0.6 else whole


def entries(pairs: dict[str, str]) -> bytes:
    """A map of strings."""
    body = b"".join(text(key) + text(value) for key, value in pairs.items())
    return struct.pack("<I", len(body)) + body


WRONG = [
    "",
    "x",
    "\x1b[2J",
    "/../../x",
    "nan",
    "[]",
    "{}",
    "-1",
    "1e999",
    "null",
    "true",
    '"0.2"',
    "9" * 400,
    "[[1]]",
    "\\ud800",
    "0",
]
KEYS = [
    "p0_mpa",
    "started_ns",
    "session",
    "name",
    "repeat",
    "period_ns",
    "valid",
    "complete",
    "signal",
    "seed",
    "fault",
    "records",
    "rig",
    "ticks",
]


def strange_facts(folder: Path, draw: random.Random) -> bytes:
    """A sound file whose facts are of other kinds than ours."""
    content = made_content(draw.choice([1, 3, 250]), draw.randrange(99))
    strange = {draw.choice(KEYS): schema.facts_from_text({"x": draw.choice(WRONG)})["x"] for _ in range(4)}
    samples = content.samples
    for name in draw.sample(sorted(samples.fields), 2):
        column = samples.fields[name]
        if len(column):
            column[draw.randrange(len(column))] = (
                draw.choice([0, 1, float("nan"), 2**31]) if column.dtype.kind == "f" else draw.choice([0, 1, 2**31 - 1])
            )
    path = folder / f"strange{draw.randrange(10**9)}.mcap"
    try:
        write_content(
            replace(
                content, run_facts={**content.run_facts, **strange}, result_facts={**content.result_facts, **strange}
            ),
            path,
        )
        return path.read_bytes()
    finally:
        path.unlink(missing_ok=True)


def changed(data: bytes, draw: random.Random) -> bytes:
    """A sound file with bytes overwritten, cut out, doubled, or with lengths that lie."""
    out = bytearray(data)
    for _ in range(draw.choice([1, 1, 3, 20])):
        place, size = draw.randrange(len(out)), draw.choice([1, 4, 8, 100, 3000])
        kind = draw.randrange(5)
        if kind == 0:
            out[place] = draw.randrange(256)
        elif kind == 1:
            out[place : place + 8] = struct.pack("<Q", draw.choice([0, 1, 9, len(out), 1 << 31, 1 << 63, 2**64 - 1]))
        elif kind == 2:
            del out[place : place + size]
        elif kind == 3:
            out[place:place] = out[place : place + size] * draw.choice([1, 2, 30])
        else:
            other = draw.randrange(len(out))
            out[place : place + size] = out[other : other + size]
        if not out:
            return b""
    return bytes(out)


def spliced(one: bytes, other: bytes, draw: random.Random) -> bytes:
    """Two sound files' records, whole each: put in among one another, left out, doubled, in another order."""
    held, more = ([data[start:end] for start, end in bounds(data)] for data in (one, other))
    for _ in range(draw.choice([1, 1, 2, 6])):
        here, there, count = draw.randrange(len(held) + 1), draw.randrange(len(more)), draw.choice([1, 2, 5])
        match draw.randrange(4):
            case 0:
                held[here:here] = more[there : there + count]
            case 1:
                held[here : here + count] = more[there : there + count]
            case 2:
                held[here : here + count] = held[here : here + count] * draw.choice([0, 2, 40])
            case 3:
                draw.shuffle(held)
    return MAGIC + b"".join(held) + (MAGIC if draw.random() < 0.8 else b"")


def bounds(data: bytes) -> Iterator[tuple[int, int]]:
    """Where each record of a sound file begins and ends."""
    start = len(MAGIC)
    while start < len(data) - len(MAGIC):
        end = start + 9 + struct.unpack_from("<Q", data, start + 1)[0]
        yield start, end
        start = end


def tables(draw: random.Random) -> bytes:
    """Text that is nearly a table."""
    head = draw.choice(
        [
            b"t_s,dp_cmd_mpa,angle_deg",
            b"t_s;dp_cmd_mpa",
            b"t_s,p1_cmd_mpa,p2_cmd_mpa",
            b'"t_s,dp_cmd_mpa',
            b"t_s,dp_cmd_mpa," + b"a," * 900,
        ]
    )
    cell = draw.choice(
        [
            b"0,0,0",
            b"1e999,nan,",
            b"1,2",
            b'"',
            b"0,0," + b"9" * 5000,
            b"," * 1500,
            b"\x1b[31m,1,2",
            b"1_0,1_1,2",
            "٣,٤,٥".encode(),
        ]
    )
    rows = b"\n".join(
        b"%d,0,%s" % (n, cell) if draw.random() < 0.5 else cell for n in range(draw.choice([1, 50, 3000]))
    )
    return draw.choice([b"", b"# x\n", b"\xef\xbb\xbf"]) + head + b"\n" + rows


def cases(seed: int, folder: Path) -> Iterator[tuple[str, bytes]]:
    """Name and bytes of one file after the other, without end."""
    draw = random.Random(seed)
    made_log(folder / "sound.mcap", 400)
    made_log(folder / "other.mcap", 250, seed=2)
    sound, other = ((folder / f"{name}.mcap").read_bytes() for name in ("sound", "other"))
    while True:
        match draw.randrange(5):
            case 0:
                yield "x.mcap", hostile(draw)
            case 1:
                yield "x.mcap", changed(sound, draw)
            case 2:
                yield "x.mcap", strange_facts(folder, draw)
            case 4:
                yield "x.mcap", spliced(sound, other, draw)
            case 3:
                yield draw.choice(
                    [
                        ("x.csv", tables(draw)),
                        ("x.mcap", changed(hostile(draw), draw)),
                        ("x.tdms", b"TDSm" + draw.randbytes(80)),
                    ]
                )


def read_every_way(path: Path) -> None:
    """Every way into a file: each ends with a result or a RigError of one line."""

    def each() -> Iterator[Callable[[], object]]:
        yield lambda: read(path)
        yield lambda: read(path, None)
        yield lambda: check(path)
        if path.suffix == ".mcap":
            yield lambda: read_content(path)
            yield lambda: read_stretch(path, 0, 1 << 62)
            yield lambda: recover(path)
        yield lambda: by_commands(path)

    for way in each():
        said = ""
        try:
            way()
        except RigError as error:
            said = str(error)
        assert "\n" not in said, said
    path.with_suffix(".recovered.mcap").unlink(missing_ok=True)


def unfit(letter: str) -> bool:
    """Whether a letter does more on a terminal than stand there."""
    return letter != "\n" and (unicodedata.category(letter) in ("Cc", "Cs") or letter in "\u202e\u2066\u2028")


def by_commands(path: Path) -> None:
    """What people call, in this process: nothing but an exit status, and no control characters on the terminal."""
    for words in (["log", "info", f"{path}"], ["log", "check", f"{path}"]):
        result = CliRunner().invoke(cli, words)
        if result.exception is not None and not isinstance(result.exception, RigError | SystemExit):
            raise result.exception
        assert result.output.replace("\n", "").isprintable() or not any(
            ord(c) < 32 for c in result.output.replace("\n", "")
        ), result.output


def assert_read_in_time(path: Path) -> float:
    """Read one file in every way, and hold it to its time; returns the seconds of processor time that it took."""
    begun = time.process_time()
    read_every_way(path)
    spent_s, size = time.process_time() - begun, path.stat().st_size
    assert spent_s < allowed_s(size), f"{spent_s:.1f} s for {size} bytes, allowed {allowed_s(size):.1f} s"
    return spent_s


def one(folder: Path, seed: int) -> Iterator[tuple[float, int, Callable[[], float]]]:
    """For `hostile_work`: the time allowed, the size, and the work, of one file after the other."""
    for name, data in cases(seed, folder):
        path = folder / name
        path.write_bytes(data)
        yield allowed_s(len(data)), len(data), partial(assert_read_in_time, path)


if __name__ == "__main__":
    sys.exit(hostile_work.main("hostile_logs", __doc__ or ""))
