"""What a board and a host recorded each alone, joined into one recording: by a stored clock, or refused."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.errors import DataError, SettingsError, TandemError
from common.frame import PixelFormat
from common.protocol.message import BoardCounts, BoardHello, CameraDescription, Pacing, Rung
from common.recording.layout import ABOUT, CLOCK, DELAYS, About, camera_name, camera_values
from common.recording.opened import open_recorded
from common.recording.recorded import Shown
from common.recording.recording_file import written
from common.recording.ros_messages import image_message
from phone_host.model import Side
from phone_host.recording.clock_messages import boot_of, clock_text, told_clocks
from phone_host.recording.joining import JoinAccount, join_recordings
from phone_host.sync.clock import ClockEstimate
from tests.support.handheld import ZERO_NS, Eye, hand, panned

CAMERA = CameraDescription(
    name="a camera",
    width_px=96,
    height_px=72,
    pixel_format=PixelFormat.MJPEG,
    period_ns=50_000_000,
    pacing=Pacing.CLOCK,
)
HELLO = BoardHello(session="s", boot_id="b1", camera=CAMERA, counts=BoardCounts(), rung=Rung(), is_long=True)
OFFSET_S = 40.0
"""What the board's clock shows more than the host's."""

BOARD_UNIX_NS, HOST_UNIX_NS = 10**15, ZERO_NS - 10**13
"""A board without a clock of the day, and a host with one. Both machines' monotonic clocks follow from these and the stamps of `panned`."""


def _clock(uncertainty_ns: int = 100_000, offset_s: float = -OFFSET_S) -> ClockEstimate:
    """What a host has measured when the board's clock showed 10 000 s."""
    reference_ns = 10_000 * 10**9
    offset_ns = round(offset_s * 1e9)
    return ClockEstimate(
        reference_ns=reference_ns,
        offset_ns=offset_ns,
        skew=0.0,
        skew_uncertainty=0.0,
        uncertainty_ns=uncertainty_ns,
        round_trip_ns=400_000,
        low_ns=offset_ns - 2 * uncertainty_ns,
        high_ns=offset_ns + 2 * uncertainty_ns,
        skew_low=0.0,
        skew_high=0.0,
    )


def _file(
    path: Path,
    shown: Sequence[Shown],
    about: About,
    *,
    side: str = "left",
    clocks: Sequence[tuple[ClockEstimate, str]] = (),
    texts: Sequence[bytes] = (),
) -> Path:
    """Write a recording of one camera, whose monotonic clock showed 10 000 s at ZERO_NS of `panned`."""
    later_ns = about.unix_ns + 10**13 - ZERO_NS
    with written(path) as file:
        file.tell(ABOUT, about.values())
        file.tell(camera_name(side), camera_values(CAMERA))
        file.attach("settings.json", "application/json", b"{}", 0)
        for estimate, boot_id in clocks:
            file.add(CLOCK, clock_text(estimate, boot_id).encode(), sequence=0, log_ns=0, publish_ns=0)
        for text in texts:
            file.add(CLOCK, text, sequence=0, log_ns=0, publish_ns=0)
        file.add(DELAYS, b"{}", sequence=0, log_ns=0, publish_ns=0)
        for one in shown:
            image = one.image
            moved = replace(image, stamp_ns=image.stamp_ns + later_ns, frame_id=side)
            times = {"log_ns": one.log_ns + later_ns, "publish_ns": one.publish_ns + later_ns}
            file.add(f"/{side}/image/compressed", image_message(moved), sequence=one.sequence, **times)
    return path


@pytest.fixture(scope="module")
def films() -> tuple[list[Shown], list[Shown]]:
    """Ten seconds of the board, of which the host saw the last six and two more; the board's clock is 40 s ahead."""
    chance = np.random.default_rng(8)
    positions = hand(chance, 12)
    board = panned(chance, positions, Eye(begin_s=0, end_s=10, rate_hz=20, offset_s=OFFSET_S))
    return board, panned(chance, positions, Eye(begin_s=4, end_s=12, rate_hz=20))


def _board(folder: Path, shown: Sequence[Shown], name: str = "board", **more: str) -> Path:
    return _file(folder / f"{name}.mcap", shown, About(unix_ns=BOARD_UNIX_NS, board_boot_id=more.get("boot", "b1")))


def _host_about(boot: str = "h1", unix_ns: int = HOST_UNIX_NS) -> About:
    return About(unix_ns=unix_ns, board_side="left", host_boot_id=boot)


def _join(paths: Sequence[Path], folder: Path, clock: Path | None = None) -> JoinAccount:
    return join_recordings(paths, folder / "joined.mcap", clock)


def _true_skews_ms(folder: Path, films: tuple[list[Shown], list[Shown]]) -> list[float]:
    """Return how much later each board image of the joined file is stamped than it was exposed by the host's clock, ms."""
    true_ns = {one.sequence: one.image.stamp_ns - round(OFFSET_S * 1e9) for one in films[0]}
    joined = open_recorded(folder / "joined.mcap").images["/left/image/compressed"]
    shift_ns = HOST_UNIX_NS + 10**13 - ZERO_NS
    return [(one.image.stamp_ns - shift_ns - true_ns[one.sequence]) / 1e6 for one in joined]


def test_a_stored_clock_is_taken_and_moves_the_stamps(tmp_path: Path, films: tuple[list[Shown], list[Shown]]) -> None:
    """The host has heard this boot of the board: its offset holds, to the microsecond; another boot's is not taken. Only what both recorded is in it, with all marks."""
    clocks = [(_clock(offset_s=7), "b0"), (_clock(), "b1"), (_clock(10**9), "b1")]
    host = _file(
        tmp_path / "host.mcap", films[1], _host_about(), side="right", clocks=clocks, texts=[b"[]", b"{", b"{}"]
    )
    account = _join([host, _board(tmp_path, films[0])], tmp_path)
    assert account.uncertainty_ns < 100_000
    assert max(map(abs, _true_skews_ms(tmp_path, films))) < 0.001
    joined = open_recorded(tmp_path / "joined.mcap")
    assert joined.is_complete
    assert joined.about == _host_about()
    assert set(joined.attachments) == {"settings.json", "board-settings.json"}
    assert len(joined.images["/left/image/compressed"]) == account.images[Side.LEFT] < len(films[0])
    assert sum(account.images.values()) + account.left_out == len(films[0]) + len(films[1])
    assert account.seconds == pytest.approx(6, abs=0.2)
    first = joined.images["/left/image/compressed"][5]
    assert first.grabbed_ns - first.image.stamp_ns == pytest.approx(2_000_000, abs=1000)
    assert first.log_ns == first.grabbed_ns
    (told,) = told_clocks(joined)
    assert told.estimate == account.clock
    assert told.boot_id == "b1"


def test_a_clock_of_another_recording_is_taken(tmp_path: Path, films: tuple[list[Shown], list[Shown]]) -> None:
    """An earlier recording of the same life of the host has heard the board; parts of a ring count as one; one of another life is refused."""
    host = _file(tmp_path / "host.mcap", films[1], _host_about(), side="right")
    parts = [_board(tmp_path, films[0][100:], "part-2"), _board(tmp_path, films[0][:100], "part-1")]
    clocks = [(_clock(), "b1")]
    early = _file(tmp_path / "early.mcap", films[1][:3], _host_about(), side="right", clocks=clocks)
    begun = [tmp_path / "drive-000003.mcap", _file(tmp_path / "drive-000004.mcap", [], About(board_boot_id="b1"))]
    begun[0].write_bytes(b"")
    account = _join([host, *parts, *begun], tmp_path, early)
    assert list(account.empty) == begun
    assert max(map(abs, _true_skews_ms(tmp_path, films))) < 0.001
    other = _file(tmp_path / "other.mcap", films[1][:3], _host_about("h2"), side="right", clocks=clocks)
    with pytest.raises(SettingsError, match="two boots of a host"):
        _join([host, *parts], tmp_path, other)
    about = _host_about(unix_ns=HOST_UNIX_NS + 10**9)
    slept = _file(tmp_path / "slept.mcap", films[1][:3], about, side="right", clocks=clocks)
    with pytest.raises(SettingsError, match="the host slept"):
        _join([host, *parts], tmp_path, slept)


def test_a_clock_that_finds_no_pairs_is_refused(tmp_path: Path, films: tuple[list[Shown], list[Shown]]) -> None:
    """Known to a second, or of no exchange at all: one line says so, names --clock, and nothing is written."""
    board = _board(tmp_path, films[0])
    vague = _file(tmp_path / "vague.mcap", films[1], _host_about(), side="right", clocks=[(_clock(10**9), "b1")])
    with pytest.raises(DataError, match=r"known only to \+-1\d\d\d ms.*--clock"):
        _join([board, vague], tmp_path)
    deaf = _file(tmp_path / "deaf.mcap", films[1], _host_about(), side="right", clocks=[(_clock(), "b0")])
    with pytest.raises(
        DataError, match=r"no clock exchange between .*board.mcap and .*deaf.mcap is stored: give --clock"
    ):
        _join([board, deaf], tmp_path)
    assert not (tmp_path / "joined.mcap").exists()


def test_parts_of_several_processes_are_brought_together(
    tmp_path: Path, films: tuple[list[Shown], list[Shown]]
) -> None:
    """Each process of one boot has a Unix time of its own; the board's clock is one."""
    host = _file(tmp_path / "host.mcap", films[1], _host_about(), side="right", clocks=[(_clock(), "b1")])
    about = About(unix_ns=BOARD_UNIX_NS + 77_000, board_boot_id="b1")
    parts = [_board(tmp_path, films[0][:100]), _file(tmp_path / "later.mcap", films[0][100:], about)]
    _join([*parts, host], tmp_path)
    assert max(map(abs, _true_skews_ms(tmp_path, films))) < 0.001


def test_what_cannot_be_joined_is_refused_in_one_line(tmp_path: Path, films: tuple[list[Shown], list[Shown]]) -> None:
    """Each with what is wrong and what to do."""
    board, host = _board(tmp_path, films[0]), _file(tmp_path / "host.mcap", films[1], _host_about(), side="right")
    known = _file(tmp_path / "known.mcap", films[1], _host_about(), side="right", clocks=[(_clock(), "b2")])
    empty = tmp_path / "empty.mcap"
    empty.write_bytes(b"")
    cases: list[tuple[list[Path], str]] = [
        ([board, host, empty], "empty.mcap is empty"),
        ([host, host], "none of these was recorded by a board alone"),
        ([board, board], "none of these was recorded by a host"),
        ([board, host, host], "were both recorded by a host"),
        ([board, _board(tmp_path, films[0], "b2", boot="b2"), host], "two boots of a board"),
        ([board, _file(tmp_path / "l.mcap", films[1], _host_about())], "no images of the host's own camera"),
        ([board, host], "no clock exchange"),
        ([_board(tmp_path, films[0][:60], "apart", boot="b2"), known], "recorded 1 s apart"),
    ]
    for paths, problem in cases:
        with pytest.raises(TandemError, match=problem):
            _join(paths, tmp_path)
        assert not (tmp_path / "joined.mcap").exists()


def test_a_board_that_said_hello_names_its_boot() -> None:
    """Its estimates carry it into the recording."""
    assert boot_of(HELLO) == "b1"
    assert boot_of(None) == ""
