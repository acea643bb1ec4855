"""Undoes the compression of other programs' files, with packages that ours do not need. Never takes more memory than the result may have."""

from collections.abc import Iterator
from typing import Any, Final

from common.recording.mcap_records import MOST_CHUNK_BYTES, InflateError

ZSTD: Final = b"\x28\xb5\x2f\xfd"
"""First bytes of what is compressed with zstd (RFC 8878, section 3.1.1)."""

_PIECE_BYTES: Final = 1 << 20
_FRAME_HEAD_BYTES: Final = 18
"""Longest head of a frame (RFC 8878, section 3.1.1.1)."""


def inflate(compression: str, data: memoryview, size: int) -> memoryview:
    """Undo a chunk's compression.

    Args:
        compression: its name: zstd or lz4.
        data: the chunk.
        size: how many bytes it claims to become.

    Raises:
        InflateError: it cannot be undone, becomes more than it claims, or claims more than any chunk has.
    """
    if size > MOST_CHUNK_BYTES:
        raise InflateError(f"a chunk claims to become {size / 1e6:.0f} MB: more than is believed")
    try:
        match compression:
            case "zstd":
                plain = zstd_reader(data).read(size + 1)
            case "lz4":
                import lz4.frame  # noqa: PLC0415 - not ours to require

                plain = lz4.frame.LZ4FrameDecompressor().decompress(data, size + 1)
            case _:
                raise InflateError(f"a chunk is compressed with {compression[:40]}, which nobody here knows")
    except ImportError as error:
        package = "zstandard" if compression == "zstd" else compression
        raise InflateError(f"a chunk is compressed with {compression}: pip install {package}") from error
    except InflateError:
        raise
    except Exception as error:
        raise InflateError(f"a chunk cannot be decompressed ({error})", size) from error
    if len(plain) != size:
        raise InflateError("a chunk cannot be decompressed (it has another length than it claims)", len(plain))
    return memoryview(plain)


def unzstd(data: bytes) -> bytes:
    """Undo the compression of a message, which does not claim a size.

    Raises:
        ImportError: the package zstandard is not installed.
        ValueError: it cannot be undone, or becomes larger than any message.
    """
    parts: list[bytes] = []
    size = 0
    for part in unzstd_pieces(data):
        parts.append(part)
        size += len(part)
        if size > MOST_CHUNK_BYTES:
            raise ValueError("it becomes larger than is believed")
    return b"".join(parts)


def unzstd_pieces(source: Any) -> Iterator[bytes]:  # noqa: ANN401 - bytes or a file; the package has no types
    """Undo the compression of a source piece by piece.

    Args:
        source: bytes, or a file that is open for reading.

    Raises:
        ImportError: the package zstandard is not installed.
        OSError: the file cannot be read.
        ValueError: it cannot be undone, or ends too early; what could be undone comes before.
    """
    import zstandard  # noqa: PLC0415 - not ours to require

    head = source[:_FRAME_HEAD_BYTES] if isinstance(source, bytes) else source.peek(_FRAME_HEAD_BYTES)
    size = 0
    try:
        claimed = zstandard.frame_content_size(head)  # -1: the frame does not say
        reader = zstd_reader(source)
        while piece := reader.read(_PIECE_BYTES):
            size += len(piece)
            yield piece
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from error
    if size < claimed:
        raise ValueError("it ends before its compression does")


def zstd_reader(source: Any) -> Any:  # noqa: ANN401 - bytes or a file; the package has no types
    """Return what gives the decompressed bytes of a source piece by piece.

    Args:
        source: bytes, or a file that is open for reading.

    Raises:
        ImportError: the package zstandard is not installed.
    """
    import zstandard  # noqa: PLC0415 - not ours to require

    return zstandard.ZstdDecompressor(max_window_size=MOST_CHUNK_BYTES).stream_reader(source)
