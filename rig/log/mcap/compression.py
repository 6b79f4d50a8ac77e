"""The compressions of MCAP chunks, by packages that a machine may lack: the best one to write, and all of them to
read."""

import struct
from collections.abc import Callable, Sequence

try:
    import zstandard
except ImportError:  # a machine without a wheel for it writes and reads its own files all the same
    zstandard = None  # type: ignore[assignment]
try:
    import lz4.frame as lz4_frame  # type: ignore[import-untyped]
except ImportError:
    lz4_frame = None

_LEVEL = 3
"""Of zstd: its default. Higher: smaller files, and a recorder that takes longer."""


def best_compression() -> tuple[str, Callable[[bytes], bytes]]:
    """Name and function of the best compression that this machine has a package for: zstd, lz4, or none."""
    if zstandard is not None:
        return "zstd", zstandard.ZstdCompressor(level=_LEVEL).compress
    if lz4_frame is not None:
        return "lz4", lz4_frame.compress
    return "", bytes


class Decompressor:
    """Unpacks to a size that is known, and never to more."""

    def __init__(self) -> None:
        self._zstd = zstandard.ZstdDecompressor() if zstandard is not None else None

    def unpack(self, compression: str, packed: memoryview, size: int) -> bytes:
        """At most `size` + 1 bytes; ValueError when the data are broken, claim another size, or need a package that is
        not there."""
        if not compression:
            return bytes(packed[: size + 1])
        if compression == "zstd" and self._zstd is not None:
            return self._unpack_zstd(self._zstd, packed, size)
        if compression == "lz4" and lz4_frame is not None:
            try:
                data: bytes = lz4_frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
            except RuntimeError:
                raise ValueError("that does not decompress") from None
            return data
        raise ValueError(f"compressed by {compression!r}, which this installation cannot open")

    def unpack_together(self, packed: Sequence[memoryview], sizes: Sequence[int]) -> list[bytes] | None:
        """Zstandard's frames to exactly these sizes, in one call that does not hold the interpreter; None where that
        cannot be: `unpack` says why."""
        if (
            self._zstd is None
            or "multi_decompress_to_buffer" not in zstandard.backend_features
            or not (sizes and all(sizes))
        ):
            return None
        try:
            if any(
                zstandard.get_frame_parameters(frame).content_size != size
                for frame, size in zip(packed, sizes, strict=True)
            ):
                return None
            opened = self._zstd.multi_decompress_to_buffer(list(packed), struct.pack(f"={len(sizes)}Q", *sizes), 1)
        except (zstandard.ZstdError, ValueError):
            return None
        return [opened[k].tobytes() for k in range(len(opened))]

    @staticmethod
    def _unpack_zstd(zstd: "zstandard.ZstdDecompressor", packed: memoryview, size: int) -> bytes:
        try:
            claimed = zstandard.get_frame_parameters(packed).content_size
            if claimed not in (size, zstandard.CONTENTSIZE_UNKNOWN):
                raise ValueError(f"whose data claim {claimed} bytes where its head says {size}")
            return zstd.decompress(packed, max_output_size=max(size, 1))
        except zstandard.ZstdError:
            raise ValueError("that does not decompress") from None
