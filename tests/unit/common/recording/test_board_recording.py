"""A board's own recording on its disk: bounded, as a ring, whole at every moment, with its end told."""

import time
from pathlib import Path

import pytest

from board_agent.disk_writer import DiskWriter
from board_agent.ring import PARTS, BoundedFiles, part_path, parts_of
from common.errors import SettingsError, UnavailableError
from common.frame import Frame, PixelFormat
from common.program.quantities import file_size
from common.recording.disk_queue import WriteEnd
from common.recording.layout import ABOUT, About, CaptureRuns
from common.recording.opened import open_recorded
from common.recording.recording_file import RecordingFile
from tests.support.pictures import jpeg
from tests.support.samples import shot

_UNIX_NS = 1_700_000_000 * 10**9
_RING_BYTES = 800_000


def _begin(file: RecordingFile) -> None:
    file.tell(ABOUT, About(unix_ns=_UNIX_NS, board_boot_id="boot").values())


def _frame(number: int) -> Frame:
    return shot(
        number,
        number * 40_000_000,
        "board:boot",
        grabbed_ns=number * 40_000_000 + 9_000_000,
        size_px=(160, 120),
        pixel_format=PixelFormat.GREY,
        payload=bytes([number % 251]) * 19_200,
    )


def _write(files: BoundedFiles, frames: range) -> DiskWriter:
    writer = DiskWriter(files, _UNIX_NS)
    for number in frames:
        writer.put(_frame(number))
    return writer


def test_a_file_ends_when_it_is_full(tmp_path: Path) -> None:
    """It never grows beyond what was given, is ended in order, and every frame is counted."""
    writer = _write(BoundedFiles(tmp_path / "a.mcap", 400_000, _begin, is_ring=False), range(100))
    written = writer.finish()
    assert written.end is WriteEnd.FULL
    assert (tmp_path / "a.mcap").stat().st_size == written.size_bytes <= 400_000
    assert written.size_bytes > 400_000 - 2 * 19_200 - 2_000
    recorded = open_recorded(tmp_path / "a.mcap")
    assert recorded.is_complete
    assert recorded.about.board_boot_id == "boot"
    shown = recorded.images["/left/image"]
    assert len(shown) == written.frames == 100 - written.lost
    assert [one.sequence for one in shown] == list(range(written.frames))
    assert shown[3].image.stamp_ns == _UNIX_NS + 120_000_000
    assert shown[3].grabbed_ns - shown[3].image.stamp_ns == 9_000_000


def test_in_a_ring_the_oldest_parts_give_way(tmp_path: Path) -> None:
    """At no moment more than its size; the newest frames are there without a gap; each part tells whose it is; it goes on after a restart."""
    path = tmp_path / "drive.mcap"
    gave_way = 0
    for life in range(2):
        writer = _write(BoundedFiles(path, _RING_BYTES, _begin, is_ring=True), range(life * 100, life * 100 + 100))
        written = writer.finish()
        assert written.end is None
        assert written.frames == 100
        gave_way += written.gave_way
        parts = list(parts_of(path).values())
        assert sum(part.stat().st_size for part in parts) <= _RING_BYTES
        kept = [one.sequence for part in parts for one in open_recorded(part).images["/left/image"]]
        assert kept == list(range(kept[0], life * 100 + 100))
        assert len(kept) * 19_200 > _RING_BYTES * (PARTS - 3) / PARTS
        assert all(open_recorded(part).about.board_boot_id == "boot" for part in parts)
    assert gave_way > 0
    assert part_path(path, 7) == tmp_path / "drive-000007.mcap"


def test_of_a_ring_that_was_cut_off_all_but_a_chunk_is_read(tmp_path: Path) -> None:
    """Its last part has no end; nothing else is missing."""
    files = BoundedFiles(tmp_path / "r.mcap", _RING_BYTES, _begin, is_ring=True)
    for number in range(12):
        frame = _frame(number)
        assert files.make_room(19_400)
        files.file.add("/left/image/compressed", frame.payload, sequence=number, log_ns=number, publish_ns=0)
    files.file.sync()
    files.file.abandon()
    parts = list(parts_of(tmp_path / "r.mcap").values())
    assert len(parts) > 2
    assert b"".join(part.read_bytes() for part in parts).count(bytes([11]) * 19_200) == 1


def test_what_does_not_fit_into_a_part_ends_the_ring(tmp_path: Path) -> None:
    """An image larger than a part: the recording ends as full, and says so."""
    writer = _write(BoundedFiles(tmp_path / "r.mcap", 8 * 19_000, _begin, is_ring=True), range(3))
    assert writer.finish().end is WriteEnd.FULL


def test_a_folder_that_goes_away_ends_the_recording(tmp_path: Path) -> None:
    """The next part cannot be made: the writer fails with its cause, and frames that come later are counted as lost."""
    folder = tmp_path / "gone"
    folder.mkdir()
    writer = DiskWriter(BoundedFiles(folder / "r.mcap", _RING_BYTES, _begin, is_ring=True), _UNIX_NS)
    for part in parts_of(folder / "r.mcap").values():
        part.unlink()
    folder.rmdir()
    for number in range(30):
        writer.put(_frame(number))
    while writer.account.end is None:
        time.sleep(0.01)
    writer.put(_frame(31))
    written = writer.finish()
    assert written.end is WriteEnd.FAILED
    assert written.cause == "its file was deleted"
    assert written.lost + written.frames == 31


def test_a_file_that_is_deleted_meanwhile_ends_the_recording(tmp_path: Path) -> None:
    """The system would go on taking its bytes, and nobody could ever read them."""
    path = tmp_path / "a.mcap"
    writer = _write(BoundedFiles(path, 10_000_000, _begin, is_ring=False), range(3))
    path.unlink()
    written = writer.finish()
    assert (written.end, written.cause, written.remedy) == (WriteEnd.FAILED, "its file was deleted", "record again")


def test_an_existing_file_is_kept(tmp_path: Path) -> None:
    """A recording never replaces one."""
    (tmp_path / "a.mcap").write_bytes(jpeg(8, 8))
    with pytest.raises(UnavailableError, match="exists already"):
        BoundedFiles(tmp_path / "a.mcap", 1_000_000, _begin, is_ring=False)
    with pytest.raises(UnavailableError, match="cannot be read"):
        parts_of(tmp_path / "none" / "a.mcap")


def test_sizes_are_read_in_their_units() -> None:
    """A number alone means MB."""
    read = [file_size(text, "--ring") for text in ("500", "2GB", "1.5 GiB", "800kb")]
    assert read == [500e6, 2e9, 1.5 * 2**30, 8e5]
    with pytest.raises(SettingsError, match="--ring is 'much'"):
        file_size("much", "--ring")


def test_runs_of_frames_are_told_together() -> None:
    """One run for frames without a gap, none if nothing was noted."""
    runs = CaptureRuns()
    for sequence, late_ns in ((4, 10), (5, 11), (9, 12)):
        runs.note(sequence, late_ns)
    assert runs.take() == b"[[4,[10,11]],[9,[12]]]"
    assert runs.take() == b""
