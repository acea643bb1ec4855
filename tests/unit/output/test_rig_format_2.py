"""What format 2 of rig.yaml added: lenses, how well the rig is known, and the views it was computed from."""

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.errors import DataError
from common.versions import RIG_FORMAT
from phone_host.model import Lens
from phone_host.output.rig_views import RigViews
from phone_host.output.rig_yaml import read_rig, read_rig_views, write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.rigs import fisheye_rig, unlike_rig


def test_lenses_come_back(tmp_path: Path) -> None:
    """A fisheye and a rational lens are written by name and read back with all coefficients; cv2.FileStorage reads the names."""
    rig, path = fisheye_rig(), tmp_path / "rig.yaml"
    write_rig(path, rig, rectify_rig(rig))
    back = read_rig(path)
    for camera, expected in ((back.left, rig.left), (back.right, rig.right)):
        assert camera.lens is expected.lens
        np.testing.assert_array_equal(camera.distortion, expected.distortion)
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert [storage.getNode(key).string() for key in ("lens1", "lens2")] == ["fisheye", "rational"]


def test_a_file_that_does_not_name_its_lenses_has_opencvs_polynomial(tmp_path: Path) -> None:
    """Format 1: four or five coefficients are a pinhole's, eight a rational lens's. A pinhole with eight is written as what it is."""
    rig, path = unlike_rig(), tmp_path / "rig.yaml"
    eight = np.concatenate([rig.right.distortion, np.zeros(3)])
    rig = replace(rig, right=replace(rig.right, distortion=eight))
    write_rig(path, rig, rectify_rig(rig))
    assert "lens2: rational" in path.read_text()
    text = path.read_text().replace(f"format_version: {RIG_FORMAT}\n", "")
    path.write_text(re.sub(r"^lens[12]:.*\n", "", text, flags=re.MULTILINE))
    back = read_rig(path)
    assert (back.left.lens, back.right.lens) == (Lens.PINHOLE, Lens.RATIONAL)


@pytest.mark.parametrize(
    ("lens", "problem"),
    [
        ("magic", "lens1 is 'magic': this program knows pinhole, rational, fisheye"),
        ("Pinhole", "lens1 is 'Pinhole'"),
        ("3", "lens1 is no word"),
        ("fisheye", "D1 has 5 values: a fisheye lens has 4 coefficients"),
        ("rational", "D1 has 5 values: a rational lens has 8 or 12 or 14 coefficients"),
    ],
)
def test_a_lens_that_is_not_known_is_refused(tmp_path: Path, lens: str, problem: str) -> None:
    """The key is named; nothing is guessed."""
    path = tmp_path / "rig.yaml"
    write_rig(path, unlike_rig(), rectify_rig(unlike_rig()))
    path.write_text(re.sub(r"^lens1:.*$", f"lens1: {lens}", path.read_text(), flags=re.MULTILINE))
    with pytest.raises(DataError, match=re.escape(problem)):
        read_rig(path)


def _covariance() -> np.ndarray:
    random = np.random.default_rng(2).normal(size=(30, 40))
    return random @ random.T * 1e-4


def test_how_well_a_rig_is_known_comes_back(tmp_path: Path) -> None:
    """The covariance to its last digits; the sigmas in the file are the square roots of its diagonal, that of the baseline along it."""
    rig, path = replace(unlike_rig(), covariance=_covariance()), tmp_path / "rig.yaml"
    write_rig(path, rig, rectify_rig(rig))
    np.testing.assert_allclose(read_rig(path).covariance, rig.covariance, rtol=1e-12)
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    sigmas = np.sqrt(np.diag(rig.covariance))
    for key, expected in (
        ("sigma_M1", sigmas[:4]), ("sigma_D1", sigmas[4:9]), ("sigma_M2", sigmas[12:16]), ("sigma_D2", sigmas[16:21]),
        ("sigma_R", sigmas[24:27]), ("sigma_T", sigmas[27:]),
    ):  # fmt: skip
        np.testing.assert_allclose(storage.getNode(key).mat().ravel(), expected, rtol=1e-12)
    along = rig.t_right_left_m / np.linalg.norm(rig.t_right_left_m)
    expected_m = np.sqrt(along @ rig.covariance[27:, 27:] @ along)
    assert storage.getNode("sigma_baseline").real() == pytest.approx(expected_m)
    write_rig(path, unlike_rig(), rectify_rig(unlike_rig()))
    assert "covariance" not in path.read_text()
    assert np.isnan(read_rig(path).covariance).all()


@pytest.mark.parametrize("change", [(3, 4, 1.0), (2, 2, -1.0), (5, 5, np.nan), (0, 0, np.inf)])
def test_what_is_no_covariance_is_refused(tmp_path: Path, change: tuple[int, int, float]) -> None:
    """Not symmetric, a negative variance, a value that is not finite."""
    path = tmp_path / "rig.yaml"
    write_rig(path, unlike_rig(), rectify_rig(unlike_rig()))
    wrong = _covariance()
    wrong[change[:2]] = change[2]
    storage = cv2.FileStorage(".yaml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.write("covariance", wrong)
    body = storage.releaseAndGetString().partition("---\n")[2]
    path.write_text(path.read_text() + body)
    with pytest.raises(DataError, match="covariance is no covariance"):
        read_rig(path)
    path.write_text(
        path.read_text().replace("covariance: !!opencv-matrix", "covariance: 3 # ").partition("\n   rows: 30")[0]
    )
    with pytest.raises(DataError, match="covariance is no matrix of 30x30"):
        read_rig(path)


def _views() -> RigViews:
    random = np.random.default_rng(1)
    left, right = random.uniform(0, 640, (2, 3, 54, 2))
    left[1, 4] = np.nan
    names = ("7", 'it\'s "two": [x]', "\u00e9")
    return RigViews(columns=9, rows=6, square_m=0.025, names=names, left_px=left, right_px=right)


def test_views_of_format_2_are_a_chessboards_and_those_of_format_3_name_their_board(tmp_path: Path) -> None:
    """A file of before marks does not say which board it shows: read as a chessboard's. One of today that does not is refused, and one of tomorrow by its number."""
    path = tmp_path / "rig.yaml"
    write_rig(path, unlike_rig(), rectify_rig(unlike_rig()), _views())
    named = path.read_text()
    assert 'board: "9x6"' in named
    unnamed = re.sub(r"\n +board: \"9x6\"", "", named)
    path.write_text(unnamed.replace(f"format_version: {RIG_FORMAT}", "format_version: 2"))
    views = read_rig_views(path)
    assert views is not None
    assert views.board == ""
    assert read_rig(path).left.width_px == 640
    path.write_text(unnamed)
    with pytest.raises(DataError, match=r"views\.board is missing: calibrate again from all pictures"):
        read_rig_views(path)
    path.write_text(named.replace(f"format_version: {RIG_FORMAT}", f"format_version: {RIG_FORMAT + 1}"))
    with pytest.raises(DataError, match=f"format_version is {RIG_FORMAT + 1}, this program reads up to {RIG_FORMAT}"):
        read_rig_views(path)


def test_views_come_back(tmp_path: Path) -> None:
    """Names as they are, corners to a thousandth of a pixel, unseen ones as such; a rig without views has none."""
    path, views = tmp_path / "rig.yaml", _views()
    write_rig(path, unlike_rig(), rectify_rig(unlike_rig()))
    assert read_rig_views(path) is None
    write_rig(path, unlike_rig(), rectify_rig(unlike_rig()), views)
    back = read_rig_views(path)
    assert back is not None
    assert (back.columns, back.rows, back.square_m, back.names) == (9, 6, 0.025, views.names)
    np.testing.assert_allclose(back.left_px, views.left_px, atol=1e-3)
    np.testing.assert_allclose(back.right_px, views.right_px, atol=1e-3)
    assert read_rig(path).left.width_px == 640


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("board_columns: 9", "board_columns: 8", "views.left does not hold the corners of each pair"),
        ("board_columns: 9", "board_columns: x", "views.board_columns is no number of corners"),
        ("square: 0.02", "square: -0.02", "views.square is no length"),
        ("names:", "nomen:", "views.names names no pairs"),
    ],
)
def test_views_that_are_not_valid_are_refused(tmp_path: Path, old: str, new: str, problem: str) -> None:
    """The key is named."""
    path = tmp_path / "rig.yaml"
    write_rig(path, unlike_rig(), rectify_rig(unlike_rig()), _views())
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(DataError, match=re.escape(problem)):
        read_rig_views(path)
