"""phone-host measure in this process: rendered photographs of a wall, whose distances are known exactly."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from phone_host.cli import main
from phone_host.model import RIG_PARAMETERS, Rig, Verdict
from phone_host.output.rig_yaml import write_rig
from phone_host.scene.cast import cast, rays_through
from phone_host.scene.scene_model import Look, rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.rectify import rectify_rig
from tests.support.overlays import write_turned
from tests.support.plain_scenes import plane_scene
from tests.support.rigs import small_rig
from tests.unit.report.test_report_keys import described_words, keys_of

_WALL = plane_scene(1.2, tilt_rad=0.4, seed=5)
_POINTS = ((100.0, 120.0), (180.5, 90.25), (150.0, 180.0))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """left.png, right.png and rig.yaml of a slanted wall, with some noise, and a piece without any texture."""
    made = tmp_path_factory.mktemp("wall")
    rig = replace(small_rig(), zero_sigma_px=0.05)
    for name, model, pose, seed in zip(("left", "right"), (rig.left, rig.right), rig_poses(rig), (1, 2), strict=True):
        image = render(_WALL, model, pose, look=Look(noise_sigma=1.0, seed=seed))
        cv2.imwrite(str(made / f"{name}.png"), image)
    _write(made / "rig.yaml", rig)
    _write(made / "rejected.yaml", replace(rig, verdict=Verdict.REJECT))
    _write(made / "plain.yaml", replace(rig, zero_sigma_px=float("nan")))
    covariance = np.zeros((RIG_PARAMETERS, RIG_PARAMETERS))
    covariance[-3:, -3:] = 4e-4 * np.outer(rig.t_right_left_m, rig.t_right_left_m)
    _write(made / "whole.yaml", replace(rig, covariance=covariance))
    return made


def _write(path: Path, rig: Rig) -> None:
    write_rig(path, rig, rectify_rig(rig))


def _true_m(at_px: tuple[float, float]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    rays = rays_through(small_rig().left, np.array([at_px[0]]), np.array([at_px[1]]))
    return np.asarray((cast(_WALL.bodies, np.zeros(3), rays).depth * rays)[:, 0], np.float64)


def _measure(folder: Path, *words: str, rig: str = "rig.yaml") -> int:
    sides = (str(folder / "left.png"), str(folder / "right.png"))
    return main(["measure", *sides, "--calibration", str(folder / rig), *words])


def test_distances_hold_the_truth(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Three points of the wall and the two distances between them: each truth lies inside its limits, which are a few per cent apart."""
    assert _measure(folder, "--points", *(f"{x},{y}" for x, y in _POINTS), "--json") == 0
    told: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert told["command"] == "measure"
    true = [_true_m(point) * 1e3 for point in _POINTS]
    for point, at_px, exact in zip(told["points"], _POINTS, true, strict=True):
        length = float(np.linalg.norm(exact))
        assert point["at_px"] == list(at_px)
        assert point["distance_mm"]["low"] < length < point["distance_mm"]["high"]
        assert point["distance_mm"]["high"] - point["distance_mm"]["low"] < 0.1 * length
        # The rectified axes are turned against the camera's, so only lengths agree.
        assert np.linalg.norm(point["point_mm"]) == pytest.approx(point["distance_mm"]["value"], abs=0.01)
    for part, (one, other) in zip(told["between"], pairwise(true), strict=True):
        assert part["length_mm"]["low"] < float(np.linalg.norm(one - other)) < part["length_mm"]["high"]
    assert keys_of(told) <= described_words("What `--json` prints", "What `measure` prints as JSON")
    assert told["uncertainty"]["includes"] == ["noise of both images", "the rig's zero (zero_sigma)"]


def test_the_text_says_what_is_included(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One line for a point, one for a distance, and which parts the uncertainty has: what rig.yaml does not hold of its own is named as missing."""
    assert _measure(folder, "--points", "100,120", "150,180", rig="plain.yaml") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("point 1  at 100,120 px: ")
    assert " mm away; x " in lines[0]
    assert lines[2].startswith("1 to 2   ")
    assert lines[-2].endswith("they include noise of both images")
    assert lines[-1].startswith("not included: the rig's own uncertainty, how exactly")
    assert _measure(folder, "--points", "100,120", "150,180") == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("not included: the baseline's own uncertainty, how")
    assert _measure(folder, "--points", "100,120", "150,180", rig="whole.yaml") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-2].endswith("they include noise of both images and the rig's calibration (covariance)")
    assert lines[-1] == "not included: the size of the board's squares, how exactly the points were picked"


def test_a_baseline_known_to_two_per_cent_widens_every_length(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A covariance of 2 % of the baseline: limits lie 3.9 % on either side, of a distance from the camera and of one between two points; noise adds less."""
    assert _measure(folder, "--points", "100,120", "150,180", "--json", rig="whole.yaml") == 0
    told: dict[str, Any] = json.loads(capsys.readouterr().out)
    lengths = [*(point["distance_mm"] for point in told["points"]), told["between"][0]["length_mm"]]
    for length in lengths:
        assert 0.039 < (length["high"] - length["low"]) / 2 / length["value"] < 0.05
    assert told["points"][0]["sigma_mm"][2] > 0.0199 * told["points"][0]["point_mm"][2]
    assert told["points"][0]["wide_because"] == "the rig's calibration is uncertain: calibrate with more pictures"


def test_an_overlay_makes_up_for_a_turn(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The right camera has turned by 0.4 degrees since: with the run's overlay.yaml the limits hold the truth, and say what they leave out."""
    words = write_turned(tmp_path, replace(small_rig(), zero_sigma_px=0.05))
    sides = (str(folder / "left.png"), str(folder / "right.png"))
    assert main(["measure", *sides, *words, "--points", "100,120", "--json"]) == 0
    told: dict[str, Any] = json.loads(capsys.readouterr().out)
    length_mm = float(np.linalg.norm(_true_m((100.0, 120.0)))) * 1e3
    distance = told["points"][0]["distance_mm"]
    assert distance["low"] < length_mm < distance["high"] < 1.03 * length_mm
    assert told["uncertainty"]["leaves_out"][-1] == "how well the overlay is known"


@pytest.mark.parametrize(
    "case",
    [
        (["--points", "100"], "rig.yaml", 2, "--points is '100': give X,Y in px"),
        (["--points", "100,nan"], "rig.yaml", 2, "--points is '100,nan'"),
        (["--points", "400,20"], "rig.yaml", 2, "--points 400,20 lies outside the left image of 320x240 px"),
        (["--points", "1,1"], "rig.yaml", 4, "--points 1,1 "),
        (["--points", "100,120"], "rejected.yaml", 4, "was rejected by its own calibration"),
        (["--points", "100,120"], "none.yaml", 4, "none.yaml cannot be read"),
    ],
)
def test_what_cannot_be_measured_is_told_in_one_line(
    folder: Path, case: tuple[list[str], str, int, str], capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit 2 for a point that makes no sense, 4 for one that has no match and for a rig that cannot be used."""
    words, rig, code, said = case
    assert _measure(folder, *words, rig=rig) == code
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_a_folder_is_no_image(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Other commands take folders: a line says what this one takes, and it is wrong use."""
    rig = str(folder / "rig.yaml")
    assert main(["measure", str(folder), str(folder), "--calibration", rig, "--points", "100,120"]) == 2
    error = capsys.readouterr().err
    assert f"{folder} is a folder, and distances are measured in one pair of images" in error
    assert error.count("\n") == 1


def test_one_bad_point_leaves_the_others(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The second of three points is outside of what both cameras see: it is named, the others are told as they are without it, and the exit code is 4."""
    assert _measure(folder, "--points", "100,120", "1,1", "150,180", "--json") == 4
    told: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert "problem" in told["points"][1]
    assert [part["length_mm"] for part in told["between"]] == [None, None]
    assert keys_of(told) <= described_words("What `--json` prints", "What `measure` prints as JSON")
    assert _measure(folder, "--points", "100,120", "150,180", "--json") == 0
    alone: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert [told["points"][0], told["points"][2]] == alone["points"]
    assert _measure(folder, "--points", "100,120", "1,1") == 4
    lines = capsys.readouterr().out.splitlines()
    assert "mm away" in lines[0]
    assert lines[1].startswith("point 2  at 1,1 px: not measured: it ")
    assert lines[2] == "1 to 2   not measured"
    assert lines[3].startswith("remedy   choose a point")


def test_a_far_from_certain_rig_is_named_as_the_reason(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """zero_sigma of 2 px makes the limits wide, and the line says so."""
    _write(folder / "vague.yaml", replace(small_rig(), zero_sigma_px=2.0))
    assert _measure(folder, "--points", "100,120", rig="vague.yaml") == 0
    assert "; uncertain, because the rig's calibration is uncertain" in capsys.readouterr().out


def test_exchanged_images_are_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """LEFT and RIGHT exchanged: no length is told, but what is wrong."""
    exchanged = ["measure", str(folder / "right.png"), str(folder / "left.png")]
    assert main([*exchanged, "--calibration", str(folder / "rig.yaml"), "--points", "100,120"]) == 4
    told = capsys.readouterr()
    assert told.out == ""
    assert "left and right are exchanged" in told.err
    assert told.err.count("\n") == 1
