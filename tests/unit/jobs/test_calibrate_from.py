"""phone-host calibrate --from: adding pictures to an earlier calibration, and solving the relative pose anew."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.errors import DataError, SettingsError
from phone_host.calibration.solve.calibrate import calibrate, solve_pose
from phone_host.calibration.solve.earlier_views import board_of, pairs_of, together, views_of
from phone_host.calibration.solve.verdict import judge
from phone_host.calibration.target.board_names import board_name, named_board
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.se3 import rotations_of, vectors_of
from phone_host.jobs.calibrate.board import Named
from phone_host.jobs.calibrate.earlier import Series, asked_of, calibrated, every_pair, notes, series_of
from phone_host.jobs.calibrate.request import CalibrateRequest
from phone_host.jobs.calibrate.rig_file import replace_rig
from phone_host.model import Lens, Rectification, Rig, Side, TimeOffset, Verdict
from phone_host.output.rig_views import RigViews
from phone_host.output.rig_yaml import read_rig, read_rig_views, write_rig
from phone_host.report.calibration_report import Known, Origin
from phone_host.stereo.rectify import rectify_rig
from phone_host.stereo.scaled_rig import scaled_rig
from phone_host.verbs.calibrate import run
from tests.support.boards import BOARD, exact_pairs, poses, render_pair
from tests.support.pictures import encoded
from tests.support.requests import request_of
from tests.support.rigs import small_rig, unlike_rig

_SIZES = ((640, 480), (1280, 720))


def _moved(rig: Rig) -> Rig:
    """The same cameras after a knock: turned by 0.6 degrees and shifted by 2 mm."""
    turn = rotations_of(np.array([0.004, -0.008, 0.005]))
    return replace(
        rig, R_right_left=turn @ rig.R_right_left, t_right_left_m=turn @ rig.t_right_left_m + [0.002, 0.0, 0.001]
    )


def _request(folder: Path, *given: str) -> CalibrateRequest:
    words = (str(folder / "left"), str(folder / "right"), *given, "--out", str(folder / "new.yaml"))
    made = request_of("calibrate", *words)
    assert isinstance(made, CalibrateRequest)
    return made


def _series(request: CalibrateRequest) -> Series:
    """The series, where the pictures show the board that is named, or the usual one."""
    return series_of(request, asked_of(request), lambda named: Known(named.board or BOARD, Origin.OPTION))[0]


def _written(folder: Path, pairs: list[BoardPair], *, with_views: bool = True) -> Path:
    """An earlier calibration in a file, of the board's camera on the right, with a measured time offset."""
    found = calibrate(pairs, BOARD, _SIZES, Side.RIGHT)
    assert found.rectification is not None
    path = folder / "rig.yaml"
    rig = replace(found.rig, time_offset=TimeOffset(5_000_000, 100_000))
    write_rig(path, rig, found.rectification, views_of(found, pairs, BOARD) if with_views else None)
    return path


def test_added_views_are_solved_together_with_the_earlier_ones(tmp_path: Path) -> None:
    """Six pairs in the file and six new ones give what twelve give at once; what the file knows besides stays."""
    pairs = exact_pairs(unlike_rig(), poses(12, seed=3), noise_px=0.1)
    path = _written(tmp_path, pairs[:6])
    series = _series(_request(tmp_path, "--from", str(path)))
    later = [replace(pair, name=str(number)) for number, pair in enumerate(pairs[6:])]
    found = calibrated(series, every_pair(series, later, _SIZES), _SIZES)
    at_once = calibrate(pairs, BOARD, _SIZES)
    np.testing.assert_allclose(found.rig.t_right_left_m, at_once.rig.t_right_left_m, atol=1e-6)
    assert len(found.used) == 12
    assert (found.rig.board_side, found.rig.time_offset) == (Side.RIGHT, TimeOffset(5_000_000, 100_000))
    assert notes(series, later, _SIZES) == [f"from     6 pairs of {path} and 6 new ones"]


def test_pictures_that_are_in_the_rig_already_do_not_count_twice(tmp_path: Path) -> None:
    """Of three known pairs and six new ones the six are added; known ones alone are refused."""
    pairs = exact_pairs(unlike_rig(), poses(12, seed=3), noise_px=0.1)
    path = _written(tmp_path, pairs[:6])
    series = _series(_request(tmp_path, "--from", str(path)))
    assert [pair.name for pair in every_pair(series, pairs[3:], _SIZES)] == [pair.name for pair in pairs]
    assert notes(series, pairs[3:], _SIZES) == [f"from     6 pairs of {path} and 6 new ones; 3 were in it already"]
    with pytest.raises(DataError, match=r"in .*rig\.yaml already"):
        every_pair(series, pairs[:2], _SIZES)


def test_names_that_are_taken_get_a_number() -> None:
    """Every pair of a second series may be named as one of the first; another board is refused."""
    pairs = exact_pairs(unlike_rig(), poses(3, seed=3))
    names = [pair.name for pair in together(together(pairs, pairs[:2]), pairs[:1])]
    assert names == ["0", "1", "2", "0 (2)", "1 (2)", "0 (3)"]
    small = [replace(pair, left_px=pair.left_px[:9], right_px=pair.right_px[:9]) for pair in pairs]
    with pytest.raises(DataError, match="another board"):
        together(pairs, small)


def test_the_pose_is_solved_anew_after_a_knock() -> None:
    """Four pairs after a knock and the earlier lenses give the new pose, within four of its stated standard deviations; the lenses stay as they were."""
    truth = unlike_rig()
    earlier = calibrate(exact_pairs(truth, poses(8, seed=1), noise_px=0.1, seed=4), BOARD, _SIZES).rig
    found = solve_pose(exact_pairs(_moved(truth), poses(4, seed=9), noise_px=0.1, seed=5), BOARD, earlier)
    np.testing.assert_array_equal(found.rig.left.matrix, earlier.left.matrix)
    np.testing.assert_array_equal(found.rig.right.distortion, earlier.right.distortion)
    sigmas = np.sqrt(np.diag(found.rig.covariance))
    off = vectors_of(found.rig.R_right_left @ _moved(truth).R_right_left.T)
    assert (np.abs(off) < 4 * sigmas[24:27]).all()
    assert (np.abs(found.rig.t_right_left_m - _moved(truth).t_right_left_m) < 4 * sigmas[27:]).all()
    # what the lenses leave open is part of it
    assert (sigmas[24:] >= np.sqrt(np.diag(earlier.covariance))[24:] * 0.3).all()
    assert np.linalg.eigvalsh(found.rig.covariance / np.outer(sigmas + 1e-12, sigmas + 1e-12)).min() > -1e-6


def test_lenses_are_scaled_to_new_pictures_and_that_is_said(tmp_path: Path) -> None:
    """Left pictures of twice the size and right ones cut at top and bottom: the pose alone comes out right, adding is refused with the way out."""
    truth = unlike_rig()
    path = _written(tmp_path, exact_pairs(truth, poses(7, seed=1), noise_px=0.02), with_views=False)
    sizes = ((1280, 960), (1280, 680))
    seen = exact_pairs(scaled_rig(truth, *sizes), poses(6, seed=2), noise_px=0.02)
    series = _series(_request(tmp_path, "--from", str(path), "--pose-only", "--board", "9x6", "--square", "25mm"))
    found = calibrated(series, seen, sizes)
    np.testing.assert_allclose(found.rig.t_right_left_m, truth.t_right_left_m, atol=3e-4)
    said = notes(series, seen, sizes)
    assert said[1].endswith("the left lens is scaled: 640x480 to 1280x960 px")
    assert said[2].endswith("the right lens is cropped to its middle: 1280x720 to 1280x680 px")
    path = _written(tmp_path, exact_pairs(truth, poses(5, seed=1)))
    with pytest.raises(DataError, match=r"the new left pictures are 1280x960 px, those of .*rig.yaml 640x480 px"):
        every_pair(_series(_request(tmp_path, "--from", str(path))), seen, sizes)


def test_what_contradicts_the_earlier_calibration_is_refused(tmp_path: Path) -> None:
    """--pose-only alone, a board that differs, no board at all, a file without views: one line each with the way out."""
    pairs = exact_pairs(unlike_rig(), poses(6, seed=3))
    path = str(_written(tmp_path, pairs))
    board = ("--board", "9x6", "--square", "25mm")
    for given, said in (
        (("--pose-only", *board), "--pose-only keeps the lenses of an earlier calibration: name it: --from rig.yaml"),
        (("--from", path, "--board", "8x6", "--square", "25mm"), "--board says 8x6, and the pictures of"),
        (("--from", path, "--board", "9x6", "--square", "30mm"), "--square says 30 mm, and the pictures of"),
        (("--from", path, "--square", "30mm"), "leave --square out and show the same board"),
        (("--from", path, "--pose-only", "--board", "8x6"), "--square is missing"),
        ((), "--square is missing"),
        (("--board", "9x6"), "--square is missing"),
    ):
        with pytest.raises(SettingsError) as caught:
            _series(_request(tmp_path, *given))
        assert said in str(caught.value)
    for again in ("--pose-only", "--board 9x6", "--board auto", "--square 25mm"):
        assert _series(_request(tmp_path, "--from", path, *again.split())).board == BOARD
    small = ("--pose-only", "--board", "8x6", "--square", "30mm")
    assert _series(_request(tmp_path, "--from", path, *small)).board == Board(8, 6, 0.03)
    bare = str(_written(tmp_path, pairs, with_views=False))
    with pytest.raises(DataError, match="does not hold the corners it was computed from"):
        _series(_request(tmp_path, "--from", bare))


def _filed(folder: Path, board: Board) -> Path:
    """A rig that says it was computed from three views of a board."""
    corners = np.zeros((3, board.columns * board.rows, 2))
    views = RigViews(
        columns=board.columns,
        rows=board.rows,
        square_m=board.square_m,
        names=("1", "2", "3"),
        left_px=corners,
        right_px=corners,
        board=board_name(board),
    )
    write_rig(folder / "rig.yaml", unlike_rig(), rectify_rig(unlike_rig()), views)
    return folder / "rig.yaml"


def _another_board(named: Named) -> Known:
    assert named.board == BOARD
    raise SettingsError("these boards have 10x7 inner corners, --board says 9x6", "give --board 10x7")


def test_another_board_in_the_new_pictures_is_named_as_that(tmp_path: Path) -> None:
    """Nobody gave --board, so the error does not speak of it but of the file."""
    request = _request(tmp_path, "--from", str(_filed(tmp_path, BOARD)))
    with pytest.raises(DataError, match=r"another board than .*rig\.yaml holds"):
        series_of(request, asked_of(request), _another_board)


@pytest.mark.parametrize(
    "name", ["9x6", "charuco:8x6:27.5mm:20mm:5x5", "aprilgrid:4x3:30mm:9mm", "charuco:5x7:30.125mm:21mm:4x4"]
)
def test_the_earlier_calibration_knows_its_board_with_its_marks(tmp_path: Path, name: str) -> None:
    """--from needs no --board: the file names it, marks included, and its side as it was measured."""
    board = named_board(name, 28.0)
    read = read_rig_views(_filed(tmp_path, board))
    assert read is not None
    again = board_of(read)
    assert (again.columns, again.rows, again.square_m) == (board.columns, board.rows, board.square_m)
    np.testing.assert_allclose(again.points_m(), board.points_m(), rtol=1e-7)
    assert type(again.marks) is type(board.marks)
    known = _series(_request(tmp_path, "--from", str(tmp_path / "rig.yaml"), "--board", name)).board
    assert known == again
    with pytest.raises(DataError, match="the earlier calibration is 'charuco:9x9"):
        board_of(replace(read, board="charuco:9x9:28mm:20mm:5x5"))
    with pytest.raises(DataError, match="the earlier calibration is 'nothing'"):
        board_of(replace(read, board="nothing"))


def test_pictures_of_another_size_are_refused_before_they_are_searched(tmp_path: Path) -> None:
    """Headers tell the size: no picture is decoded, and the way out holds; --pose-only scales lenses, but not to any shape."""
    path = str(_filed(tmp_path, BOARD))
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        for number in range(3):
            (tmp_path / side / f"{number}.png").write_bytes(encoded(".png", np.zeros((48, 64), np.uint8)))
    with pytest.raises(DataError, match=r"the new left pictures are 64x48 px, .*640x480 px.*alone, without --from"):
        run(_request(tmp_path, "--from", path))
    with pytest.raises(DataError, match="right image is 64x48 px, neither a scaling nor a crop"):
        run(_request(tmp_path, "--from", path, "--pose-only"))


def test_the_command_adds_to_a_rig_and_solves_the_pose(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From pictures: the new file holds the views of both series and can be added to again; after --pose-only it holds none."""
    for index, pose in enumerate(poses(8, seed=8, depth_m=(0.4, 0.5))):
        for side, image in zip(("left", "right"), render_pair(small_rig(), pose), strict=True):
            folder = tmp_path / ("first" if index < 4 else "second") / side
            folder.mkdir(parents=True, exist_ok=True)
            (folder / f"{index % 4}.png").write_bytes(encoded(".png", image))
    first, second = tmp_path / "first", tmp_path / "second"
    run(_request(first, "--board", "9x6", "--square", "25mm"))
    run(_request(second, "--from", str(first / "new.yaml")))
    views = read_rig_views(second / "new.yaml")
    assert views is not None
    assert views.board == "9x6"
    assert len(set(views.names)) == len(views.names) == len(pairs_of(views)) > 5
    both = (second / "new.yaml").read_bytes()
    run(_request(second, "--from", str(second / "new.yaml"), "--pose-only"))
    assert read_rig_views(second / "new.yaml") is None
    assert (second / "new.yaml.old").read_bytes() == both
    np.testing.assert_allclose(
        read_rig(second / "new.yaml").left.matrix, read_rig(second / "new.yaml.old").left.matrix, rtol=1e-12
    )
    told = capsys.readouterr().out
    assert "its lenses are kept, the relative pose is new" in told
    assert "the earlier one is now new.yaml.old" in told


def replaced(out: Path, rig: Rig | None, made: Rectification | None, views: RigViews | None = None) -> str:
    """Replace a rig as the command does: the new files are written elsewhere, then they take their places."""
    place = out.parent / "new"
    place.mkdir(exist_ok=True)
    name = replace_rig(place, out, rig, made, views)
    for path in place.iterdir():
        path.replace(out.parent / path.name)
    return name


def test_no_views_are_lost(tmp_path: Path) -> None:
    """A file whose views the new one does not hold is moved aside, and kept there from one without views; one whose views are all in the new one is replaced."""
    rig, out = unlike_rig(), _filed(tmp_path, BOARD)
    made, views = rectify_rig(rig), read_rig_views(out)
    assert replaced(out, rig, made, views) == ""
    assert replaced(out, rig, made) == "rig.yaml.old"
    assert replaced(out, rig, made) == ""
    assert replaced(out, rig, made, views) == ""
    rejected = replace(rig, verdict=Verdict.REJECT)
    out.write_text(out.read_text().partition("# what the rig was")[0])  # it loses its views
    assert replaced(out, rejected, made) == "rig.yaml.old2"
    assert replaced(out, rig, None) == replaced(out, None, None) == "rig.yaml"
    assert read_rig(out).is_rejected
    kept = read_rig_views(tmp_path / "rig.yaml.old")
    assert kept is not None
    assert kept.names == ("1", "2", "3")


def test_unlike_lenses_are_chosen_by_views_that_were_held_out() -> None:
    """A fisheye camera beside a webcam: the fisheye formula is chosen for the one, a pinhole for the other, and the baseline is right to its sigma."""
    rig = unlike_rig()
    bent = replace(
        rig.left,
        matrix=np.array([[300.0, 0, 318], [0, 301, 241], [0, 0, 1]]),
        distortion=np.array([0.02, -0.01, 0.004, -0.001]),
        lens=Lens.FISHEYE,
    )
    wide = replace(rig.right, matrix=np.array([[640.0, 0, 652], [0, 641, 351], [0, 0, 1]]))
    truth = replace(rig, left=bent, right=replace(wide, distortion=np.array([-0.1, 0.02, 0.0, 0.0, 0.0])))
    random, boards = np.random.default_rng(2), list[np.ndarray]()
    while len(boards) < 10:
        turn, depth_m = random.uniform(-0.5, 0.5, 3), random.uniform(0.2, 0.45)
        centre = np.array([*random.uniform(-0.75, 0.75, 2), 1.0]) * depth_m
        pose = np.concatenate([turn, centre - np.asarray(cv2.Rodrigues(turn)[0]) @ BOARD.points_m().mean(axis=0)])
        (pair,) = exact_pairs(truth, pose[np.newaxis])
        if all(
            ((px > 3) & (px < np.array(size) - 4)).all()
            for px, size in zip((pair.left_px, pair.right_px), _SIZES, strict=True)
        ):
            boards.append(pose)
    pairs = exact_pairs(truth, np.array(boards), noise_px=0.05, seed=1)
    found = calibrate(pairs, BOARD, _SIZES)
    assert [bend.lens for bend in found.bends] == [Lens.FISHEYE, Lens.PINHOLE]
    assert len(found.used) == 10
    off_m = np.linalg.norm(found.rig.t_right_left_m) - np.linalg.norm(truth.t_right_left_m)
    assert abs(off_m) < 4 * found.baseline_sigma_m < 1e-3
    assert judge(found, ()).verdict is Verdict.GOOD
