"""Photographs are paired by the numbers in their names, whatever each side's folder holds; otherwise by their order."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.camera.factory import open_camera
from common.camera.image_numbers import ImageNumbers, numbers_of, numbers_told, with_numbers
from common.frame import Frame
from common.protocol.wire_fields import MAX_TEXT
from common.stamp import HOST_CLOCK
from phone_host.stereo.view_files import pair_files
from phone_host.sync.stills import PairedBy, PassedOver, Stills, Wanted, WhyOrder
from tests.support.numbered import write_film

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


@pytest.mark.many
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


SECOND_NS = 10**9
EUROC_NS = 1403636579763555584
"""The first image's time in a public data set, ns since 1970."""

TIMES = st.sets(st.integers(0, 2**59 - 1), min_size=2, max_size=30).flatmap(
    lambda steps: st.integers(10**15, 2**63 - 2**59).map(lambda start: tuple(sorted(start + step for step in steps)))
)


def time_labels(numbers: tuple[int, ...], folder: Path) -> list[int]:
    """The stamps that a replay of images with these times gives its frames, ns."""
    folder.mkdir()
    image = write_film(folder.parent / f"{folder.name}-one", 1) / "0.jpg"
    for number in numbers:
        (folder / f"{number}.jpg").write_bytes(image.read_bytes())
    camera = open_camera(f"replay:{folder}", HOST_CLOCK, 5 * SECOND_NS)
    frames = [camera.read(6 * SECOND_NS)[0] for _ in numbers]
    return [frame.exposed.ns for frame in frames if isinstance(frame, Frame)]


def test_images_named_by_times_are_paired_by_them(tmp_path: Path) -> None:
    """One image is missing on each side, each of another moment: the two alone are named, and no pair is of two moments.

    The same holds where the first is missing on one side and the last on the other, and for a host that comes late.
    """
    every = [EUROC_NS + number * SECOND_NS // 20 for number in range(9)]
    for at, (theirs, mine) in enumerate(((7, 3), (8, 0), (0, 8))):
        board, own = (tuple(n for n in every if n != every[gone]) for gone in (theirs, mine))
        labels = time_labels(board, tmp_path / str(at))
        assert max(labels) < 2**59  # an older host refuses labels from 2**60 on
        for first in (0, 4):
            stills = Stills(told(own), own)
            stills.begin(numbers_told(with_numbers("replay left", told(board))), PERIOD_NS)
            found = [stills.wanted(sequence, labels[sequence]) for sequence in range(first, 8)]
            assert stills.paired_by is PairedBy.NUMBER
            pairs = [(board[first + n], own[item.index]) for n, item in enumerate(found) if item.index is not None]
            assert pairs == [(number, number) for number in board[first:] if number in own]
            assert [item.number for item in found if item.index is None] == [n for n in board[first:] if n not in own]


@pytest.mark.many
@given(TIMES, TIMES, st.data())
def test_times_anywhere_in_63_bits_meet_their_own(
    numbers: tuple[int, ...], others: tuple[int, ...], data: st.DataObject
) -> None:
    """Labels modulo 2**59 lose nothing: each image meets its own, also in the second lap, and no image meets another."""
    own = tuple(sorted({*data.draw(st.sets(st.sampled_from(numbers), min_size=1)), *others}))
    if own[-1] - own[0] >= 2**59 or len(own) < 2 or not told(own).are_times or not told(numbers).are_times:
        return
    stills = Stills(told(own, looped=True), own)
    stills.begin(told(numbers, looped=True), PERIOD_NS)
    if stills.paired_by is PairedBy.ORDER:
        return  # no end is shared
    for sequence in range(2 * len(numbers)):
        lap, position = divmod(sequence, len(numbers))
        number = numbers[position]
        index = stills.wanted(sequence, number % 2**59).index
        assert index == (lap * len(own) + own.index(number) if number in own else None)


def test_times_that_each_camera_stamped_itself_are_paired_by_order_and_say_so() -> None:
    """As many over as long a time, but none alike; a counter beside times. Where some could be alike, they pair by number."""
    board = tuple(EUROC_NS + number * SECOND_NS for number in range(9))
    late = tuple(number + 3_000_017 for number in board)
    for own, why in (
        (late, WhyOrder.OTHER),
        (tuple(range(9)), WhyOrder.OTHER),
        (late[1:], None),
        (board[1:], None),
        (board, None),
    ):
        stills = Stills(told(own), own)
        stills.begin(told(board), PERIOD_NS)
        assert stills.why_order is why
    inner, outer = board[1:-1], (*board[:3], *board[5:])  # as many, no end shared, but not as long
    stills = Stills(told(inner), inner)
    stills.begin(told(outer), PERIOD_NS)
    assert stills.why_order is None


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
    assert stills.unshown == PassedOver(alone=1, numbers=(9,))


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
        (["1403636579763555584", "1403636579813555456"], (1403636579763555584, 1403636579813555456)),
        (["cam0_7_1403636579763555584", "cam0_8_1403636579813555456"], (7, 8)),
        (["9223372036854775807", "9223372036854775806"], (2**63 - 1, 2**63 - 2)),
        (["9223372036854775808", "9223372036854775806"], ()),
        (["10000000000000000000", "20000000000000000000"], ()),
        (["1", "576460752303423489"], ()),
        (["a1", "b"], ()),
    ],
)
def test_the_number_is_the_one_that_counts_the_images(names: list[str], numbers: tuple[int, ...]) -> None:
    """It tells all names apart and leaves out the fewest values, so it is neither a camera's own number nor a time of day; the last of two alike.

    A single image has no number, nor have names whose numbers do not fit 63 bits or lie 2**59 apart.
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


@given(st.text(max_size=200), TIMES.filter(lambda numbers: len(numbers) > 1), st.booleans())
def test_times_in_a_name_are_read_back(name: str, numbers: tuple[int, ...], looped: bool) -> None:  # noqa: FBT001
    """With 19 digits too; an older host, which knows nothing of times, still reads how many images there are."""
    images = told(numbers, looped=looped)
    told_name = with_numbers(name, images)
    assert len(told_name) <= MAX_TEXT
    assert numbers_told(told_name) == images
    older = re.search(r" \((\d{1,9}) images?(?:, (\d{1,15}) to (\d{1,15}))?(, looped)?\)\Z", told_name)
    assert older is not None
    assert (int(older[1]), older[2], bool(older[4])) == (len(numbers), None, looped)


@pytest.mark.parametrize(
    "name",
    [
        "replay left",
        "webcam (2 images)x",
        "x (0 images)",
        "x (5 images, 9 to 3)",
        "x (9 images, 3 to 5)",
        "x [3 to 18] (16 images)",
        "x [1403636579763555584 to 9999999999999999999] (2 images)",
    ],
)
def test_a_name_that_tells_nothing_or_nonsense_is_not_believed(name: str) -> None:
    """Other cameras, older boards and liars tell no numbers."""
    assert numbers_told(name) is None
