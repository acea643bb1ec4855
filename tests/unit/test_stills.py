"""Photographs are paired by the numbers in their names, whatever each side's folder holds; otherwise by their order."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.camera.image_numbers import ImageNumbers, numbers_of, numbers_told, with_numbers
from common.protocol.wire_fields import MAX_TEXT
from phone_host.stereo.view_files import pair_files
from phone_host.sync.stills import PairedBy, PassedOver, Stills, Wanted

PERIOD_NS = 33_333_333
FIRST_NS = 7_000_000_000_000


def told(numbers: tuple[int, ...], *, looped: bool = False) -> ImageNumbers:
    """What a replay tells of images with these numbers."""
    return ImageNumbers(count=len(numbers), first=numbers[0], last=numbers[-1], looped=looped)


def label_ns(numbers: tuple[int, ...], sequence: int) -> int:
    """The stamp of a board's image, first + k / fps, where k counts from its first number: exactly, with 30 fps."""
    lap, position = divmod(sequence, len(numbers))
    span = numbers[-1] - numbers[0] + 1
    return FIRST_NS + round((lap * span + numbers[position] - numbers[0]) * 1e9 / 30)


def asked(own: tuple[int, ...], board: tuple[int, ...], sequences: range) -> tuple[list[int | None], Stills]:
    """The own images (their numbers) that each of the board's frames meets."""
    stills = Stills(told(own), own)
    stills.begin(told(board), PERIOD_NS)
    found = [stills.wanted(sequence, label_ns(board, sequence)) for sequence in sequences]
    return [None if wanted.index is None else own[wanted.index] for wanted in found], stills


def sides() -> st.SearchStrategy[tuple[int, ...]]:
    """Ascending numbers of a folder."""
    return st.sets(st.integers(0, 300), min_size=2, max_size=40).map(lambda numbers: tuple(sorted(numbers)))


@given(sides(), sides())
def test_each_image_meets_the_one_of_its_number_and_every_other_is_counted(
    own: tuple[int, ...], board: tuple[int, ...]
) -> None:
    """Both folders may start anywhere, have gaps and differ in length: pairs have one number, and nothing gets lost."""
    stills = Stills(told(own), own)
    stills.begin(told(board), PERIOD_NS)
    assert stills.paired_by is PairedBy.NUMBER
    pairs, alone, passed = [], 0, 0
    for sequence, number in enumerate(board):
        wanted = stills.wanted(sequence, label_ns(board, sequence))
        passed += wanted.passed.alone + wanted.passed.unsent
        if wanted.index is None:
            alone += 1
        else:
            pairs.append((number, own[wanted.index]))
    assert pairs == [(number, number) for number in board if number in own]
    assert alone == len(set(board) - set(own))
    assert passed + stills.unshown.alone + stills.unshown.unsent == len(set(own) - set(board))


def test_a_host_that_comes_late_still_meets_the_right_numbers() -> None:
    """A board without gaps tells its numbers by counting alone, so the first image is not needed."""
    board, own = tuple(range(3, 19)), tuple(range(5, 21))
    found, _ = asked(own, board, range(4, 16))
    assert found == list(range(7, 19))


def test_a_host_that_comes_late_to_numbers_with_gaps_pairs_by_order() -> None:
    """Where the gaps lie before the first image that came is unknown; the run says that it pairs by order."""
    found, stills = asked((1, 2, 3, 4), (1, 2, 5, 6), range(1, 4))
    assert stills.paired_by is PairedBy.ORDER
    assert found == [2, 3, 4]


def test_an_older_board_or_names_without_numbers_pair_by_order() -> None:
    """The k-th image of one side meets the k-th of the other, and what is left over has no partner."""
    for board, numbers in ((None, (4, 5, 6)), (told((1, 2, 3)), ()), (ImageNumbers(count=3), (4, 5, 6))):
        stills = Stills(ImageNumbers(count=3), numbers)
        stills.begin(board, PERIOD_NS)
        assert stills.paired_by is PairedBy.ORDER
        assert [stills.wanted(sequence, 0).index for sequence in range(3)] == [0, 1, 2]
    stills = Stills(ImageNumbers(count=5), ())
    stills.begin(ImageNumbers(count=3), PERIOD_NS)
    assert [stills.wanted(sequence, 0) for sequence in (0, 2)] == [Wanted(0), Wanted(2, PassedOver(unsent=1))]
    assert stills.unshown == PassedOver(alone=2)


def test_an_image_that_the_board_has_but_did_not_send_is_told_from_one_that_it_has_not() -> None:
    """Number 4 was spoiled on the board; 9 is only here."""
    board, own = (3, 4, 5), (3, 4, 5, 9)
    stills = Stills(told(own), own)
    stills.begin(told(board), PERIOD_NS)
    stills.wanted(0, label_ns(board, 0))
    assert stills.wanted(2, label_ns(board, 2)) == Wanted(2, PassedOver(unsent=1))
    assert stills.unshown == PassedOver(alone=1)


@pytest.mark.parametrize("own_loops", [True, False])
def test_with_loop_the_numbers_come_again(*, own_loops: bool) -> None:
    """In the board's second lap each number meets its own again; a host that does not loop has nothing more to show."""
    board, own = (3, 4, 7), (4, 5, 7)
    stills = Stills(told(own, looped=own_loops), own)
    stills.begin(told(board, looped=True), PERIOD_NS)
    found = [stills.wanted(sequence, label_ns(board, sequence)).index for sequence in range(6)]
    assert found[:3] == [None, 0, 2]
    assert found[3:] == ([None, 3, 5] if own_loops else [3, 3, 3])  # 3 is beyond its last image: the camera ends


@pytest.mark.parametrize(
    ("names", "numbers"),
    [
        (["frame7", "frame10"], (7, 10)),
        (["cam0_0012", "cam0_0013"], (12, 13)),
        (["0012_cam1", "0013_cam1"], (12, 13)),
        (["cam0_0012_120530", "cam0_0013_120533"], (12, 13)),
        (["120530_cam0_0012", "120533_cam0_0015", "120534_cam0_0013"], (12, 15, 13)),
        (["5_1", "6_2"], (1, 2)),
        (["left", "right"], ()),
        (["a1", "b1"], ()),
        (["only12"], ()),
        (["1403636579763555584", "1403636579813555456"], ()),
        (["a1", "b"], ()),
    ],
)
def test_the_number_is_the_one_that_counts_the_images(names: list[str], numbers: tuple[int, ...]) -> None:
    """It tells all names apart and leaves out the fewest values, so it is neither a camera's own number nor a time of day; the last of two alike.

    A single image, and times in ns, have no number.
    """
    assert numbers_of(names) == numbers


@pytest.mark.parametrize("name", ["cam{side}_{number:04}_{time}", "{time}_{number}_cam{side}", "{side}_{number}"])
def test_a_camera_chooses_the_number_that_stereo_chooses(tmp_path: Path, name: str) -> None:
    """Times of day differ between the sides, so `stereo` pairs by the counter; each camera takes the same number from its own names alone."""
    sides: list[list[str]] = []
    for side in (0, 1):
        (tmp_path / str(side)).mkdir()
        stems = [name.format(side=side, number=n, time=120530 + 3 * n + side) for n in (9, 10, 12)]
        for stem in stems:
            (tmp_path / str(side) / f"{stem}.png").touch()
        sides.append(stems)
    files = pair_files(str(tmp_path / "0"), str(tmp_path / "1"))
    paired = tuple(int(number) for number, _, _ in files.pairs)
    assert files.by_number
    assert paired == numbers_of(sides[0]) == numbers_of(sides[1]) == (9, 10, 12)


@given(st.text(max_size=200), st.integers(1, 10**6), st.none() | st.integers(0, 10**9), st.booleans())
def test_what_a_name_tells_is_read_back(name: str, count: int, first: int | None, looped: bool) -> None:  # noqa: FBT001
    """However long the folder's name is, the numbers get through a hello."""
    last = None if first is None else first + count + 5
    images = ImageNumbers(count=count, first=first, last=last, looped=looped)
    told_name = with_numbers(name, images)
    assert len(told_name) <= MAX_TEXT
    assert numbers_told(told_name) == images


@pytest.mark.parametrize(
    "name", ["replay left", "webcam (2 images)x", "x (0 images)", "x (5 images, 9 to 3)", "x (9 images, 3 to 5)"]
)
def test_a_name_that_tells_nothing_or_nonsense_is_not_believed(name: str) -> None:
    """Other cameras, older boards and liars tell no numbers."""
    assert numbers_told(name) is None
