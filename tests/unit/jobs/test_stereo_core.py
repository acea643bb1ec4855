"""The options of the stereo core: what they build, and what is refused in one line with its remedy."""

import argparse
import json
import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.errors import DataError, SettingsError, TandemError
from common.program.request import add_options, read_request
from phone_host.cli import main
from phone_host.jobs.depth import LimitedDepthOptions, depth_wanted
from phone_host.jobs.stereo_core import build_core, refuse_rejected
from phone_host.model import Crop, Side, StereoGeometry, Verdict
from phone_host.output.axes import Axes
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.core import StereoCore
from phone_host.stereo.rectify import rectify_rig
from tests.support.planes import noise
from tests.support.rigs import unlike_rig

MOTORCYCLE = """cam0=[994.978 0 311.193; 0 994.978 254.877; 0 0 1]
cam1=[994.978 0 342.279; 0 994.978 254.877; 0 0 1]
doffs=31.086
baseline=193.001
width=741
height=497
ndisp=70
"""
"""As Middlebury publishes it (quarter size)."""


def parsed(*words: str) -> LimitedDepthOptions:
    """The options as a verb gets them."""
    parser = argparse.ArgumentParser()
    add_options(parser, LimitedDepthOptions)
    return read_request(LimitedDepthOptions, vars(parser.parse_args(words)))


def core_of(*words: str, size_px: tuple[int, int] = (640, 480)) -> StereoCore:
    """The core that these words build."""
    options = parsed(*words)
    core, _ = build_core(options, options.calibration or "", "sgbm", size_px)
    assert core is not None
    return core


def rig_file(folder: Path) -> str:
    """A rig.yaml of 640x480 and 1280x720."""
    rig = unlike_rig()
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    return str(folder / "rig.yaml")


def test_lengths_may_have_units() -> None:
    """537.2mm, 53.72cm and 0.5372m are one baseline, and a number alone is mm; the focal length may say px."""
    expected = StereoGeometry(focal_px=994.978, baseline_m=0.5372, cx_px=319.5, cy_px=239.5)
    for baseline in ("537.2", "537.2mm", "53.72cm", "0.5372m"):
        for focal in ("994.978", "994.978px"):
            geometry = core_of("--rectified", "--disparities", "64", "--focal", focal, "--baseline", baseline).geometry
            assert geometry is not None
            assert geometry.baseline_m == pytest.approx(0.5372)
            assert replace(geometry, baseline_m=0.5372) == expected


def test_near_is_a_range_by_default_and_a_limit_when_given() -> None:
    """Without --near nothing is cut, and the search begins at 300 mm; --near 20cm does both; --disparities replaces the search only."""
    assert depth_wanted(parsed()).near_m == 0
    assert depth_wanted(parsed()).search_from_m == pytest.approx(0.3)
    given = depth_wanted(parsed("--near", "20cm", "--far", "5m"))
    assert (given.near_m, given.search_from_m, given.far_m) == (0.2, 0.2, 5)
    fixed = depth_wanted(parsed("--near", "200", "--disparities", "64"))
    assert fixed.near_m == 0.2
    assert math.isnan(fixed.search_from_m)


def test_the_rest_is_passed_on() -> None:
    """--crop and --scale become what they say; without them the core decides; --axes is for files."""
    wanted = depth_wanted(parsed("--crop", "10,20,300,200", "--scale", "0.5"))
    assert wanted.crop == Crop(x_px=10, y_px=20, width_px=300, height_px=200)
    assert wanted.scale == 0.5
    plain = depth_wanted(parsed())
    assert plain.crop is None
    assert math.isnan(plain.scale)
    assert math.isnan(plain.far_m)
    assert parsed().axes is Axes.CAMERA
    assert parsed("--axes", "y-up").axes is Axes.Y_UP


def test_a_rig_brings_its_side_and_its_range(tmp_path: Path) -> None:
    """With rig.yaml, N follows from --near for the images that come: f b / 0.6 m = 526 x 0.10026 / 0.6 = 87.9, so 96."""
    options = parsed("--near", "600")
    core, side = build_core(options, rig_file(tmp_path), "sgbm", (0, 0))
    assert side is Side.LEFT
    assert core is not None
    processed = core.compute(np.zeros((480, 640), np.uint8), np.zeros((720, 1280), np.uint8), lambda: 0)
    assert processed.search is not None
    assert processed.search.disparities == 96


def test_calib_txt_makes_metres_of_rectified_images(tmp_path: Path) -> None:
    """Middlebury's file gives geometry and ndisp; --near or --disparities replace ndisp; --rectified may be said as well."""
    path = tmp_path / "calib.txt"
    path.write_text(MOTORCYCLE)
    left = noise(741, 497)
    for words, expected in (
        ((), 70),
        (("--rectified",), 70),
        (("--disparities", "32"), 32),
        (("--near", "2m"), 80),  # 994.978 x 0.193001 / 2 - 31.086 = 64.9
    ):
        core = core_of("--calibration", str(path), *words, size_px=(741, 497))
        assert core.geometry == StereoGeometry(
            focal_px=994.978, baseline_m=0.193001, cx_px=311.193, cy_px=254.877, doffs_px=31.086
        )
        search = core.compute(left, left, lambda: 0).search
        assert search is not None
        assert search.disparities == expected


def test_calib_txt_scales_to_a_smaller_copy_of_its_images(tmp_path: Path) -> None:
    """Images of half the stated size have half of f, doffs and ndisp; images of another shape are refused."""
    path = tmp_path / "calib.txt"
    path.write_text(MOTORCYCLE.replace("width=741\nheight=497", "width=740\nheight=496"))
    core = core_of("--calibration", str(path), size_px=(370, 248))
    assert core.geometry is not None
    assert core.geometry.focal_px == pytest.approx(994.978 / 2)
    assert core.geometry.doffs_px == pytest.approx(31.086 / 2)
    assert core.geometry.baseline_m == pytest.approx(0.193001)
    search = core.compute(noise(370, 248), noise(370, 248), lambda: 0).search
    assert search is not None
    assert search.disparities == 35
    with pytest.raises(DataError, match=r"images are 640x480 px, no scaling of the 740x496 px"):
        core_of("--calibration", str(path), size_px=(640, 480))


def test_kittis_colour_images_get_the_colour_cameras(tmp_path: Path) -> None:
    """Its cameras 0 and 1 are 540 mm apart, 2 and 3 only 530: the folder of the left image tells which are meant."""
    rows = [
        f"P{camera}: 700 0 600 {-700 * x_m} 0 700 180 0 0 0 1 0" for camera, x_m in enumerate((0, 0.54, -0.06, 0.47))
    ]
    path = tmp_path / "calib.txt"
    path.write_text("\n".join(rows) + "\n")
    for left, right, expected_m in (
        ("image_0", "image_1", 0.54),
        ("image_2", "image_3", 0.53),
        ("image_02/data", "image_03/data", 0.53),
        ("image_20", "image_21", 0.54),
        ("image_2/grey/image_0", "image_2/grey/image_1", 0.54),
    ):
        for folder in (left, right):
            (tmp_path / folder).mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(tmp_path / folder / "000000.png"), noise(320, 96))
        words = (str(tmp_path / left), str(tmp_path / right), "--calibration", str(path), "--out", str(tmp_path / "o"))
        assert main(["stereo", *words]) == 4  # noise has no depth, which the report says, too
        found = json.loads((tmp_path / "o" / "report.json").read_text())["geometry"]["baseline_m"]
        assert found == pytest.approx(expected_m)


def test_with_metres_the_range_follows_from_near() -> None:
    """Rectified images with focal length and baseline need no --disparities: 500 x 0.06 / 0.3 = 100, so 112."""
    core = core_of("--rectified", "--focal", "500", "--baseline", "60", size_px=(320, 240))
    search = core.compute(noise(320, 240), noise(320, 240), lambda: 0).search
    assert search is not None
    assert search.disparities == 112


def test_a_rejected_rig_is_refused_unless_it_is_asked_for() -> None:
    """A rig with verdict reject is bad data, and the remedy names the option that uses it all the same; other verdicts pass."""
    rejected = replace(unlike_rig(), verdict=Verdict.REJECT)
    with pytest.raises(DataError, match=r"rig\.yaml was rejected") as caught:
        refuse_rejected(rejected, "rig.yaml", allowed=False)
    assert "--use-rejected-rig" in caught.value.remedy
    refuse_rejected(rejected, "rig.yaml", allowed=parsed("--use-rejected-rig").use_rejected_rig)
    for verdict in (None, Verdict.GOOD, Verdict.USABLE):
        refuse_rejected(replace(rejected, verdict=verdict), "rig.yaml", allowed=False)


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("--rectified",), "--rectified without --disparities"),
        (("--rectified", "--disparities", "1000000000"), "--disparities 1000000000 is more than any image is wide"),
        (("--rectified", "--disparities", "16", "--far", "5m"), "--far without --focal and --baseline"),
        (("--rectified", "--disparities", "16", "--near", "5m"), "--near without --focal and --baseline"),
        (("--far", "5m"), "--far without --calibration"),
        (("--crop", "0,0,9,9"), "--crop without --calibration"),
        (("--scale", "0.5"), "--scale without --calibration"),
        (("--near", "0"), "--near is '0'"),
        (("--near", "two"), "--near is 'two'"),
        (("--far", "-3"), "--far is '-3'"),
        (("--near", "5m", "--far", "500"), "--near 5m is not nearer than --far 0.5m"),
        (("--crop", "1,2,3"), "--crop is '1,2,3'"),
        (("--crop", "1,2,0,4"), "--crop is '1,2,0,4'"),
        (("--crop", "1.5,2,3,4"), "--crop is '1.5,2,3,4'"),
        (("--crop", "nan,2,3,4"), "--crop is 'nan,2,3,4'"),
        (("--scale", "0.05"), "--scale is '0.05'"),
        (("--scale", "half"), "--scale is 'half'"),
        (("--scale", "2"), "--scale is '2'"),
        (("--rectified", "--focal", "0", "--baseline", "60"), "--focal is '0'"),
        (("--rectified", "--focal", "long", "--baseline", "60"), "--focal is 'long'"),
        (("--rectified", "--focal", "500", "--baseline", "60px"), "--baseline is '60px'"),
        (("--rectified", "--focal", "500", "--baseline", "0.193"), "--baseline 0.193 has no unit"),
        (("--rectified", "--focal", "500", "--baseline", "193001"), "--baseline 193001 is 193.001 m"),
        (("--rectified", "--focal", "500", "--baseline", "11m"), "--baseline 11m is 11 m"),
        (("--near", "0.3"), "--near 0.3 has no unit"),
        (("--far", "2"), "--far 2 has no unit"),
        (("--rectified", "--focal", "500", "--baseline", "60", "--center", "1,2,3"), "--center is '1,2,3'"),
        (("--rectified", "--focal", "500", "--baseline", "60", "--doffs", "x"), "--doffs is 'x'"),
    ],
)
def test_what_makes_no_sense_is_refused_with_a_remedy(words: tuple[str, ...], problem: str) -> None:
    """Each is a mistake in the options: the error begins with the option and ends with what to give."""
    with pytest.raises(SettingsError) as caught:
        build_core(_parsed_joined(words), "", "sgbm", (640, 480))
    assert caught.value.problem.startswith(problem)
    assert caught.value.remedy


def _parsed_joined(words: tuple[str, ...]) -> LimitedDepthOptions:
    """Parse with `--name=value`, so that a value may begin with a minus."""
    joined: list[str] = []
    for word in words:
        if joined and joined[-1] != "--rectified" and "=" not in joined[-1]:
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return parsed(*joined)


def test_without_a_rig_there_is_no_core() -> None:
    """Neither a calibration nor rectified images: pairs and delays only."""
    assert build_core(parsed(), "", "sgbm", (640, 480)) == (None, None)


def test_errors_are_of_one_family() -> None:
    """A missing calibration file is bad data, not a crash."""
    with pytest.raises(TandemError, match="nowhere"):
        build_core(parsed(), "nowhere.yaml", "sgbm", (640, 480))
