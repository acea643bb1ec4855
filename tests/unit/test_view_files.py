"""Pairing of image files by the numbers in their names."""

from pathlib import Path

import pytest

from common.errors import DataError, SettingsError
from phone_host.calibration.view_files import pair_files


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
    with pytest.raises(DataError, match=r"LEFT .* names no image"):
        pair_files(str(tmp_path / name), str(good))
