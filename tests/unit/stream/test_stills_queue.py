"""The pair queue with stills on both sides: every image ends in a pair or as an orphan with its reason."""

from dataclasses import replace
from pathlib import Path

import pytest

from common.camera.factory import open_camera
from common.camera.image_numbers import ImageNumbers, ShowsFiles, with_numbers
from common.errors import SettingsError
from common.protocol.message import CameraDescription, Pacing
from common.stamp import HOST_CLOCK
from phone_host.run.course import require_one_kind
from phone_host.stream.demand_clock import DemandClock
from phone_host.stream.own_camera import OwnCamera
from phone_host.stream.pair_queue import PairQueue
from phone_host.sync.fifo import FifoSettings, Overflow
from phone_host.sync.stills import PairedBy, Stills
from tests.support.numbered import write_film
from tests.support.programs import until
from tests.unit.stream.test_pair_queue import PERIOD_NS, board_frame, camera_of, host_frame


def board_of(images: ImageNumbers) -> CameraDescription:
    """A board that shows stills."""
    return replace(camera_of(PERIOD_NS, Pacing.DEMAND), name=with_numbers("replay left", images))


def queue_of(own: tuple[int, ...], board: tuple[int, ...]) -> tuple[PairQueue, DemandClock]:
    """A queue of two folders with these numbers."""
    images = ImageNumbers(count=len(own), first=own[0], last=own[-1])
    demand = DemandClock(Pacing.DEMAND, Stills(images, own))
    queue = PairQueue(FifoSettings(99, Overflow.DROP_NEWEST), None, PERIOD_NS, demand=demand, own_images=images)
    queue.begin(board_of(ImageNumbers(count=len(board), first=board[0], last=board[-1])))
    return queue, demand


def test_images_without_a_partner_are_orphans_with_the_reason() -> None:
    """The board shows 3 to 6, this machine has 4, 6, 7: two pairs; 3 and 5 of the board and 7 of this machine stay alone."""
    queue, demand = queue_of((4, 6, 7), (3, 4, 5, 6))
    shown: list[int] = []
    for sequence in range(4):
        queue.add_board(board_frame(sequence, sequence * PERIOD_NS))
        if sequence in {1, 3}:
            demand.show_next(lambda _label_ns, index: shown.append(index), lambda: None)
            queue.add_host(host_frame(sequence, 0))
    queue.board_ended()
    queue.finish()
    counts = queue.counts
    assert shown[0] == 0
    assert (counts.received, counts.paired, counts.held_board, counts.held_host) == (4, 2, 0, 0)
    assert dict(counts.board_orphans) == {"no_image_of_that_number": 2}
    assert dict(counts.host_orphans) == {"no_image_of_that_number": 1}
    assert counts.host_frames == counts.paired + 1
    assert (queue.images.paired_by, queue.images.board_alone, queue.images.own_alone) == (PairedBy.NUMBER, 2, 1)
    assert (queue.images.board_numbers, queue.images.own_numbers) == ((3, 5), (7,))


def test_a_spoiled_image_of_this_machine_holds_nothing_up(tmp_path: Path) -> None:
    """Its board frame is an orphan at once, so there is credit for the next one."""
    camera = open_camera(f"replay:{write_film(tmp_path / 'film', 4, spoil_every=2)}", HOST_CLOCK, 0)
    assert isinstance(camera, ShowsFiles)
    assert camera.description.pacing is Pacing.DEMAND
    demand = DemandClock(Pacing.DEMAND, Stills(camera.images, camera.numbers))
    queue = PairQueue(FifoSettings(9, Overflow.DROP_NEWEST), None, PERIOD_NS, demand=demand, own_images=camera.images)
    queue.begin(board_of(camera.images))
    own = OwnCamera(camera, queue.add_host, demand, queue.own_image_missing)
    own.start()
    for sequence in range(4):
        queue.add_board(board_frame(sequence, sequence * PERIOD_NS))
    until(lambda: queue.counts.held_board == 0, "every question has an answer")
    own.stop()
    queue.finish()
    counts = queue.counts
    assert (counts.paired, own.spoiled, dict(counts.board_orphans)) == (2, 2, {"no_partner": 2})


def test_the_next_board_session_begins_with_the_first_image_again() -> None:
    """What an earlier life of the board left waiting is given up, and nothing counts twice."""
    queue, demand = queue_of((1, 2), (1, 2))
    queue.add_board(board_frame(0, 0))
    queue.begin(board_of(ImageNumbers(count=2, first=1, last=2)))
    assert dict(queue.counts.board_orphans) == {"stream_ended": 1}
    queue.add_board(board_frame(0, 0))
    shown: list[int] = []
    for _ in range(2):  # the first question is of the earlier life and shows nothing
        demand.show_next(lambda _label_ns, index: shown.append(index), lambda: None)
    assert shown == [0]


@pytest.mark.parametrize("board", list(Pacing))
def test_stills_beside_a_clock_are_refused_and_both_are_named(board: Pacing) -> None:
    """Two of one kind pass; of two kinds the line says which side shows stills, and what to change."""
    images = ImageNumbers(count=9, first=0, last=8)
    theirs = replace(camera_of(PERIOD_NS, board), name=with_numbers("replay left", images))
    require_one_kind(replace(theirs, name="replay right"), theirs)
    other = Pacing.CLOCK if board is Pacing.DEMAND else Pacing.DEMAND
    with pytest.raises(SettingsError) as caught:
        require_one_kind(replace(theirs, name="replay right", pacing=other), theirs)
    stills, film = ("replay:left", "replay:right") if board is Pacing.DEMAND else ("replay:right", "replay:left")
    assert f"{stills} shows stills" in caught.value.problem
    assert f"{film} keeps a clock" in caught.value.problem
    assert "fps=" in caught.value.remedy


@pytest.mark.parametrize(
    ("options", "pacing"),
    [
        ("", Pacing.DEMAND),
        ("?fps=5", Pacing.CLOCK),
        ("?loop=1", Pacing.CLOCK),
        ("?pace=clock", Pacing.CLOCK),
        ("?phase_ms=2", Pacing.CLOCK),
        ("?fps=5&loop=1&pace=demand", Pacing.DEMAND),
    ],
)
def test_a_folder_without_a_films_options_is_stills(options: str, pacing: Pacing, tmp_path: Path) -> None:
    """A rate, a loop, a phase or pace=clock make a film of a folder, a glob or a single file."""
    folder = write_film(tmp_path / "film", 2)
    for path in (folder, folder / "*.jpg", folder / "0.jpg"):
        assert open_camera(f"replay:{path}{options}", HOST_CLOCK, 0).description.pacing is pacing


def test_stamps_of_stills_leave_a_gap_where_a_number_is_missing(tmp_path: Path) -> None:
    """Images 0, 1 and 4 at 30 a second are stamped 0, 1/30 and 4/30 s after the first; their sequence has no gap."""
    folder = write_film(tmp_path / "film", 5)
    for number in (2, 3):
        (folder / f"{number}.jpg").unlink()
    camera = open_camera(f"replay:{folder}", HOST_CLOCK, 0)
    frames = [camera.read(1000 + at)[0] for at in range(3)]
    assert [getattr(frame, "sequence", None) for frame in frames] == [0, 1, 2]
    assert [frame.exposed.ns - 1000 for frame in frames if hasattr(frame, "exposed")] == [0, 33_333_333, 133_333_333]
    assert camera.description.name == "replay film (3 images, 0 to 4)"
