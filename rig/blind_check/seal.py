"""Labels under seal: a hash that is printed before the run, a blob that says nothing without its key.

The blob is the labels' JSON under a one-time key (SHAKE-256 key stream, HMAC-SHA-256 tag). The hash is that of the JSON
itself, so whoever holds it can check the opened labels with `sha256sum`.
"""

import hashlib
import hmac
import json
import secrets
from dataclasses import dataclass
from typing import Any

from rig.errors import RecordError

_TAG_BYTES = 32


@dataclass(frozen=True)
class Sealed:
    """What may lie open: the hash and the blob."""

    sha256: str
    blob: bytes


def new_key() -> bytes:
    """A key for one sheet of labels; never use it for a second."""
    return secrets.token_bytes(32)


def seal(labels: Any, key: bytes) -> Sealed:
    """`labels` (plain data) under `key`."""
    text = _text(labels)
    closed = _mixed(text, key)
    return Sealed(hashlib.sha256(text).hexdigest(), closed + hmac.digest(key, closed, "sha256"))


def open_sealed(blob: bytes, key: bytes, sha256: str, where: str) -> Any:
    """The labels again; RecordError when key or blob are not those of the printed hash."""
    closed, tag = blob[:-_TAG_BYTES], blob[-_TAG_BYTES:]
    if not hmac.compare_digest(tag, hmac.digest(key, closed, "sha256")):
        raise RecordError(f"{where}: the seal is broken: these labels were changed or belong to another key")
    text = _mixed(closed, key)
    if hashlib.sha256(text).hexdigest() != sha256:
        raise RecordError(f"{where}: these are not the labels whose hash was printed before the run")
    return json.loads(text)


def _text(labels: Any) -> bytes:
    return json.dumps(labels, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def _mixed(data: bytes, key: bytes) -> bytes:
    stream = hashlib.shake_256(b"pamrig blind check" + key).digest(len(data))
    return bytes(a ^ b for a, b in zip(data, stream, strict=True))
