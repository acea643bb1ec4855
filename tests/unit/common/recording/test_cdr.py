"""The edges of ROS 2's encoding: nothing to write, nothing to read, and bytes that are none of it."""

import pytest

from common.recording.cdr import HEADER, BrokenMessageError, CdrReader, CdrWriter


def test_an_empty_sequence_is_its_count_alone() -> None:
    """It takes no place for alignment; an array of no values takes none at all."""
    writer = CdrWriter()
    writer.doubles((), counted=True)
    writer.doubles((), counted=False)
    writer.number("B", 7)
    data = writer.done()
    assert data == HEADER + bytes(4) + b"\7"
    reader = CdrReader(data)
    assert reader.number("I") == 0
    assert reader.number("B") == 7


@pytest.mark.parametrize("data", [b"", b"\0\0\0\0", HEADER, HEADER + b"\2\0\0\0\xff\0", HEADER + b"\x10\0\0\0ab"])
def test_other_bytes_are_refused(data: bytes) -> None:
    """Another header, no value, a text that is not UTF-8, and one that is cut short."""
    with pytest.raises(BrokenMessageError):
        CdrReader(data).text()
