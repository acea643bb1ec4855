"""Pairing of image files by the numbers in their names."""

from pathlib import Path

import pytest

from common.camera.image_numbers import numbers_of
from common.camera.replay import find_images
from common.errors import DataError, SettingsError
from common.name_order import name_order
from phone_host.report.stereo_report import distinct_names
from phone_host.stereo.view_files import is_unread_photograph, pair_files, passed_over


def _touch(folder: Path, *names: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).touch()
    return folder


def test_numbers_are_numbers_and_missing_partners_are_named(tmp_path: Path) -> None:
    """2 comes before 10, 07 is 7, and a file without a partner stays alone."""
    left = _touch(tmp_path / "l", "left10.png", "left2.png", "left07.png", "left3.png", "notes.txt", ".hidden2.png")
    right = _touch(tmp_path / "r", "r_2.jpg", "r_7.jpg", "r_10.jpg", "r_11.jpg")
    files = pair_files(str(left), str(right))
    assert files.by_number
    assert [(name, a.name, b.name) for name, a, b in files.pairs] == [
        ("2", "left2.png", "r_2.jpg"), ("7", "left07.png", "r_7.jpg"), ("10", "left10.png", "r_10.jpg"),
    ]  # fmt: skip
    assert [path.name for path in files.left_alone] == ["left3.png"]
    assert [path.name for path in files.right_alone] == ["r_11.jpg"]


@pytest.mark.parametrize(
    ("left", "right"), [("{}_L.png", "{}_R.png"), ("cam0_{}.png", "cam1_{}.png"), ("{}_cam0.png", "{}_cam1.png")]
)
def test_the_number_that_counts_is_found_wherever_it_stands(tmp_path: Path, left: str, right: str) -> None:
    """Of two numbers in a name, the one that differs within a view pairs the files, not the one that tells the views apart."""
    _touch(tmp_path, *(pattern.format(n) for n in (1, 5, 12) for pattern in (left, right)))
    files = pair_files(str(tmp_path / left.format("*")), str(tmp_path / right.format("*")))
    assert [name for name, _, _ in files.pairs] == ["1", "5", "12"]
    assert files.left_alone == files.right_alone == ()


def test_without_numbers_equal_names_are_pairs(tmp_path: Path) -> None:
    """One image is missing on the right: in their order all pairs would be of unlike scenes."""
    left = _touch(tmp_path / "ml", "board.png", "desk.png", "room.png")
    right = _touch(tmp_path / "mr", "desk.jpg", "room.jpg", "shelf.jpg")
    files = pair_files(str(left), str(right))
    assert (files.by_number, files.by_name) == (False, True)
    assert [(a.name, b.name) for _, a, b in files.pairs] == [("desk.png", "desk.jpg"), ("room.png", "room.jpg")]
    assert [path.name for path in (*files.left_alone, *files.right_alone)] == ["board.png", "shelf.jpg"]


def test_files_of_one_name_are_paired_by_their_folders(tmp_path: Path) -> None:
    """A folder for each moment holds the images of both cameras; one lacks its right image."""
    for folder, names in (("cup", ("left", "right")), ("desk", ("left",)), ("hall", ("left", "right"))):
        _touch(tmp_path / folder, *(f"{name}.png" for name in names))
    files = pair_files(str(tmp_path / "*" / "left.png"), str(tmp_path / "*" / "right.png"))
    assert (files.by_number, files.by_name) == (False, True)
    assert [(name, a.parent.name, b.parent.name) for name, a, b in files.pairs] == [
        ("cup", "cup", "cup"), ("hall", "hall", "hall"),
    ]  # fmt: skip
    assert (files.left_alone, files.right_alone) == ((tmp_path / "desk" / "left.png",), ())


def test_a_pair_is_named_by_what_differs() -> None:
    """Files' names alone where they tell the files apart, else with as many folders as that needs."""
    assert list(distinct_names(["l/1.png", "l/2.png"]).values()) == ["1.png", "2.png"]
    assert list(distinct_names(["x/a/left.png", "x/b/left.png"]).values()) == ["a/left.png", "b/left.png"]
    assert list(distinct_names(["a/0/left.png", "b/0/left.png", "b/1/left.png"]).values()) == [
        "a/0/left.png", "b/0/left.png", "b/1/left.png",
    ]  # fmt: skip
    assert distinct_names([]) == {}


def test_without_numbers_the_order_of_names_pairs(tmp_path: Path) -> None:
    """Names without numbers are paired in their order."""
    left, right = _touch(tmp_path / "l", "a.png", "c.png"), _touch(tmp_path / "r", "b.png", "d.png", "e.png")
    files = pair_files(str(left), str(right))
    assert not files.by_number
    assert [(a.name, b.name) for _, a, b in files.pairs] == [("a.png", "b.png"), ("c.png", "d.png")]
    assert [path.name for path in files.right_alone] == ["e.png"]


def test_one_folder_for_both_sides_gets_a_hint(tmp_path: Path) -> None:
    """The same folder twice is a usage error that shows how globs separate the sides."""
    _touch(tmp_path, "left1.png", "right1.png")
    with pytest.raises(SettingsError, match=r"left\*"):
        pair_files(str(tmp_path), str(tmp_path))


@pytest.mark.parametrize("name", ["nowhere", "*.png", "empty"])
def test_a_side_without_images_is_named(tmp_path: Path, name: str) -> None:
    """A missing folder, a glob without matches and an empty folder are refused; the error names the side."""
    _touch(tmp_path / "empty")
    good = _touch(tmp_path / "good", "a1.png")
    with pytest.raises(DataError, match="RIGHT"):
        pair_files(str(good), str(tmp_path / name))


@pytest.mark.parametrize("name", ["hidden", "hidden/.*.png"])
def test_hidden_files_alone_are_no_images(name: str, tmp_path: Path) -> None:
    """A folder or a glob with only hidden files is refused like an empty one; the error names the side."""
    _touch(tmp_path / "hidden", ".a1.png")
    good = _touch(tmp_path / "good", "a1.png")
    with pytest.raises(DataError, match=r"LEFT .* (names no image|is empty)"):
        pair_files(str(tmp_path / name), str(good))


def test_two_files_are_a_pair_whatever_their_numbers(tmp_path: Path) -> None:
    """Who names two files means this pair."""
    folder = _touch(tmp_path, "im0.png", "im1.png")
    files = pair_files(str(folder / "im0.png"), str(folder / "im1.png"))
    assert [(a.name, b.name) for _, a, b in files.pairs] == [("im0.png", "im1.png")]
    assert files.left_alone == files.right_alone == ()


def test_a_file_with_brackets_in_its_name_is_a_file_and_no_pattern(tmp_path: Path) -> None:
    """A name that exists is taken as it is."""
    folder = _touch(tmp_path, "left[1].png", "right[1].png", "left1.png")
    files = pair_files(str(folder / "left[1].png"), str(folder / "right[1].png"))
    assert [a.name for _, a, _ in files.pairs] == ["left[1].png"]


def test_a_folder_beside_a_file_is_refused(tmp_path: Path) -> None:
    """The line says which of the two is which, whatever their order."""
    folder, file = _touch(tmp_path / "l", "1.png"), _touch(tmp_path, "right.png") / "right.png"
    with pytest.raises(SettingsError, match=r"LEFT .* is a folder, RIGHT .*right\.png is a file"):
        pair_files(str(folder), str(file))
    with pytest.raises(SettingsError, match=r"RIGHT .* is a folder, LEFT .*right\.png is a file"):
        pair_files(str(file), str(folder))


def test_the_same_file_twice_is_refused_with_the_remedy_for_files(tmp_path: Path) -> None:
    """For two files, no advice about folders and globs is given."""
    file = _touch(tmp_path, "left.png") / "left.png"
    with pytest.raises(SettingsError, match="image of the other camera as RIGHT"):
        pair_files(str(file), str(file))


def test_files_that_are_no_images_are_left_out_and_named_when_nothing_else_is_there(tmp_path: Path) -> None:
    """Thumbs.db and texts lie in many folders of photographs; a pattern may catch them as well."""
    left = _touch(tmp_path / "l", "Thumbs.db", "1.png", "notes.txt")
    right = _touch(tmp_path / "r", "1.png", "Thumbs.db")
    assert len(pair_files(str(left), str(right)).pairs) == 1
    files = pair_files(str(left / "*"), str(right / "*"))
    assert (len(files.pairs), files.left_alone, files.right_alone) == (1, (), ())
    other = _touch(tmp_path / "o", "Thumbs.db", "notes.txt")
    with pytest.raises(DataError, match=r"names no image, only 2 other files \(\.db, \.txt\)"):
        pair_files(str(left), str(other))
    film = _touch(tmp_path / "f", "left.MP4")
    with pytest.raises(
        DataError, match=r"only 1 other file \(\.mp4\): take pictures of the same moments out of both films"
    ):
        pair_files(str(film), str(film))


def test_a_name_that_leads_nowhere_does_not_exist(tmp_path: Path) -> None:
    """A missing file is not called a pattern without images."""
    right = _touch(tmp_path, "right.png") / "right.png"
    with pytest.raises(DataError, match=r"left\.png' does not exist"):
        pair_files(str(tmp_path / "left.png"), str(right))


def test_several_files_of_a_side_are_paired_by_number(tmp_path: Path) -> None:
    """What a shell made of unquoted globs is paired like the globs: 2 with 2, 10 with 10; 3 stays alone."""
    left, right = (
        [tmp_path / f"{side}{number}.png" for number in numbers]
        for side, numbers in (("l", (10, 2, 3)), ("r", (2, 10)))
    )
    for path in (*left, *right):
        path.touch()
    files = pair_files([str(path) for path in left], [str(path) for path in right])
    assert [name for name, _, _ in files.pairs] == ["2", "10"]
    assert files.left_alone == (tmp_path / "l3.png",)


def test_saved_pairs_are_paired_by_the_numbers_of_their_folders(tmp_path: Path) -> None:
    """In what a run has saved, each pair has a folder and all images are called left.png and right.png; 4 has no left one."""
    for number in (0, 4, 15):
        _touch(tmp_path / f"pair-{number:06d}", "right.png", *([] if number == 4 else ["left.png"]))
    files = pair_files(str(tmp_path / "pair-*" / "left.png"), str(tmp_path / "pair-*" / "right.png"))
    assert files.by_number
    assert [name for name, _, _ in files.pairs] == ["0", "15"]
    assert [path.parent.name for path in files.right_alone] == ["pair-000004"]


def test_only_ascii_digits_number_a_file(tmp_path: Path) -> None:
    """Superscripts, circled digits and those of other scripts are letters: they neither fail nor pair."""
    left = _touch(tmp_path / "l", "1²3.png", "②.png", "٣.png", "4.png", "10.png")
    right = _touch(tmp_path / "r", "r1.png", "r3.png", "r4.png", "r10.png")
    files = pair_files(str(left), str(right))
    assert [(name, a.name, b.name) for name, a, b in files.pairs] == [
        ("3", "1²3.png", "r3.png"), ("4", "4.png", "r4.png"), ("10", "10.png", "r10.png"),
    ]  # fmt: skip
    assert {path.name for path in files.left_alone} == {"②.png", "٣.png"}
    names = [path.name for path in find_images(str(left))]
    assert names == sorted(names, key=lambda name: name_order(Path(name)))
    assert numbers_of(["a²", "a①"]) == ()


def test_one_file_that_cannot_be_looked_at_ends_nothing(tmp_path: Path) -> None:
    """A link that leads in a circle is passed over, and told with all else that a picture's name promises and that is not read."""
    left = _touch(tmp_path / "l", "1.png", "2.png", "3.heic", "4.raw", "notes.txt", ".hidden.heic")
    (left / "5.png").symlink_to("5.png")
    (left / "6.png").mkdir()
    files = pair_files(str(left), str(_touch(tmp_path / "r", "1.png", "2.png")))
    assert [name for name, _, _ in files.pairs] == ["1", "2"]
    told = passed_over([str(left)])
    assert [path.name for path in told] == ["3.heic", "4.raw", "5.png", "6.png"]
    assert [is_unread_photograph(path) for path in told] == [True, False, False, False]
    assert passed_over([str(left / "*.png"), str(left / "1.png")]) == ()


def test_folders_without_files_are_told_apart(tmp_path: Path) -> None:
    """An empty folder, one that holds the folders of both cameras, and one whose only entry is a circle of links."""
    good = str(_touch(tmp_path / "good", "1.png"))
    _touch(tmp_path / "both" / "l", "1.png")
    _touch(tmp_path / "both" / "r", "1.png")
    _touch(tmp_path / "circle")
    (tmp_path / "circle" / "1.png").symlink_to("1.png")
    for name, said in (("both", r"holds only folders \(l and r\): give the folder"), ("circle", "cannot be read")):
        with pytest.raises(DataError, match=said):
            pair_files(str(tmp_path / name), good)
    with pytest.raises(DataError, match="is empty"):
        pair_files(str(_touch(tmp_path / "empty")), good)
