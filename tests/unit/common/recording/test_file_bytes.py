"""The bytes of a file that another program makes shorter while they are read."""

import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import DataError
from common.recording.file_bytes import PIECE_BYTES, FileBytes, pieces
from common.recording.opened import open_recorded
from common.recording.recorded import Shown
from tests.support.recorded import recording_file

SIZE = 100_000
CONTENT = bytes(number % 251 for number in range(SIZE))
PLACES = st.integers(0, SIZE)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file that each test fills."""
    return tmp_path_factory.mktemp("bytes") / "file.mcap"


@given(PLACES, PLACES, PLACES, PLACES)
@settings(deadline=None, max_examples=60)
def test_a_slice_of_a_slice_is_that_of_bytes(file: Path, start: int, stop: int, inner: int, end: int) -> None:
    """Any slice of a slice has the length and the content that bytes in memory have."""
    file.write_bytes(CONTENT)
    part = FileBytes.whole(file)[start:stop][inner:end]
    assert len(part) == len(CONTENT[start:stop][inner:end])
    assert bytes(part) == CONTENT[start:stop][inner:end]


@given(PLACES, PLACES, PLACES)
@settings(deadline=None, max_examples=60)
def test_at_any_truncation_a_slice_is_whole_or_one_error(file: Path, start: int, size: int, left: int) -> None:
    """Wherever a file ends that became shorter, a slice gives all its bytes or the error that names the file."""
    file.write_bytes(CONTENT)
    part = FileBytes.whole(file)[start : start + size]
    os.truncate(file, left)
    if len(part) and start + len(part) > left:
        with pytest.raises(DataError, match=r"file\.mcap became shorter while it was read: copy it first"):
            bytes(part)
    else:
        assert bytes(part) == CONTENT[start : start + size]


def test_pieces_are_the_whole(file: Path) -> None:
    """The pieces of a long file are its bytes, each at its place."""
    content = CONTENT * 25
    file.write_bytes(content)
    found = list(pieces(FileBytes.whole(file), 7))
    assert b"".join(piece for _, piece in found) == content[7:]
    assert [at for at, _ in found] == list(range(7, len(content), PIECE_BYTES))


def _payload(shown: Shown) -> bytes | None:
    """The bytes of an image; None: the file became shorter."""
    try:
        return bytes(shown.image.payload)
    except DataError:
        return None


def test_each_image_of_a_recording_that_shrinks_is_whole_or_one_error(tmp_path: Path) -> None:
    """At any truncation each image is the one that it was, or the error; those before the end can all be had."""
    path = recording_file(tmp_path, 12)
    found = open_recorded(path)
    shown = [each for of in found.images.values() for each in of]
    whole = [bytes(each.image.payload) for each in shown]
    data = path.read_bytes()
    for left in range(0, len(data), len(data) // 30):
        path.write_bytes(data)
        os.truncate(path, left)
        for each, image in zip(shown, whole, strict=True):
            found_bytes = _payload(each)
            assert found_bytes in (image, None)
            assert found_bytes is not None or data.rindex(image) + len(image) > left
