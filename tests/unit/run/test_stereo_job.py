"""The work of `stereo` on image files: pairs one after another, results in folders, and what goes wrong is named."""

import json
import math
import resource
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.errors import DataError, SettingsError, UnavailableError
from phone_host.diagnostics.codes import Code
from phone_host.model import Image, StereoGeometry
from phone_host.output.axes import Axes
from phone_host.report.stereo_report import Size
from phone_host.run.file_pairs import FilePairs
from phone_host.run.stereo_job import run_stereo
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.view_files import pair_files
from tests.support.point_files import read_pfm, read_xyz

_SHIFTS = {2: 6, 7: 9, 11: 12}  # px, by the number in the name


class _Watch:
    """What a progress bar would show."""

    def __init__(self) -> None:
        self.said: list[str] = []
        self.done = 0

    def __call__(self, amount: int = 1) -> None:
        self.done += amount

    def say(self, what: str) -> None:
        self.said.append(what)


def _texture(width: int) -> Image:
    noise = cv2.GaussianBlur(np.random.default_rng(4).normal(size=(64, width)), (0, 0), 1.2)
    image: Image = np.clip(128 + noise / noise.std() * 50, 0, 255).astype(np.uint8)
    return image


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    """Folders left and right with three pairs; the texture of each is shifted by another number of px."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
    for number, shift in _SHIFTS.items():
        wide = _texture(120 + shift)
        cv2.imwrite(str(tmp_path / "left" / f"l{number}.png"), wide[:, :120])
        cv2.imwrite(str(tmp_path / "right" / f"r{number:03d}.png"), wide[:, shift:])
    return tmp_path


def _core(size_px: Size, far_m: float = math.nan) -> StereoCore:
    """A core for rectified images with f b = 10 px m, whose principal point is the middle."""
    centre = (size_px[0] - 1) / 2, (size_px[1] - 1) / 2
    geometry = StereoGeometry(focal_px=100, baseline_m=0.1, cx_px=centre[0], cy_px=centre[1])
    return StereoCore(MatchSettings(disparities=16), None, geometry, DepthWanted(far_m=far_m))


def _job(photos: Path, make_core: Callable[[Size], StereoCore] = _core) -> FilePairs:
    files = pair_files(str(photos / "left"), str(photos / "right"))
    return FilePairs(files=files, out=photos / "out", make_core=make_core, matcher="sgbm")


def test_each_pair_gets_a_folder_with_its_number_and_its_own_depth(photos: Path) -> None:
    """Pairs 2, 7 and 11 have disparities 6, 9 and 12: their folders hold depth 10 / 6, 10 / 9 and 10 / 12 m, and report.json lists them."""
    watch = _Watch()
    report = run_stereo(_job(photos), watch)
    assert report.is_sound
    assert watch.done == 3
    out = photos / "out"
    assert {path.name for path in out.iterdir()} == {
        ".tandemscan", "report.json", "index.html", "pair-000002", "pair-000007", "pair-000011",
    }  # fmt: skip
    told = json.loads((out / "report.json").read_text())
    assert [pair["name"] for pair in told["pairs"]] == [f"pair-{number:06d}" for number in _SHIFTS]
    assert (told["paired_by"], told["computed"], told["failed"], told["warnings"]) == ("number", 3, 0, [])
    for number, shift in _SHIFTS.items():
        folder = out / f"pair-{number:06d}"
        assert np.nanmedian(read_pfm(folder / "disparity.pfm")) == pytest.approx(shift, abs=0.05)
        assert np.nanmedian(read_xyz(folder / "xyz.pfm")[..., 2]) == pytest.approx(10 / shift, rel=0.01)
        own = json.loads((folder / "report.json").read_text())
        assert sorted(own["files"]) == sorted(path.name for path in folder.iterdir())
        [entry] = [pair for pair in told["pairs"] if pair["name"] == folder.name]
        assert (entry["density"], entry["points"]) == (own["density"], own["points"])


def test_the_only_pair_lies_in_the_results_folder_itself(photos: Path) -> None:
    """One pair of two folders needs no folder of its own; images without partner are named in its report."""
    for name in ("left/l2.png", "left/l7.png", "right/r007.png"):
        (photos / name).unlink()
    report = run_stereo(_job(photos), _Watch())
    told = json.loads((photos / "out" / "report.json").read_text())
    assert {path.name for path in (photos / "out").iterdir()} == {".tandemscan", *told["files"]}
    assert np.nanmedian(read_pfm(photos / "out" / "disparity.pfm")) == pytest.approx(12, abs=0.05)
    assert report.right_alone == (str(photos / "right" / "r002.png"),)
    assert "r002.png" in told["warnings"][-1]


def test_a_bad_pair_among_many_is_named_and_the_others_go_on(photos: Path) -> None:
    """A spoiled image, or one of another size, costs only its own pair; the report is not sound then."""
    (photos / "left" / "l7.png").write_bytes(b"no image")
    cv2.imwrite(str(photos / "right" / "r002.png"), _texture(80))
    report = run_stereo(_job(photos), _Watch())
    assert not report.is_sound
    assert [pair.name for pair in report.computed] == ["pair-000011"]
    told = {pair.name: pair.failure.message for pair in report.failed}
    assert "r002.png is 80x64 px" in told["pair-000002"]
    assert "l7.png" in told["pair-000007"]
    listed = json.loads((photos / "out" / "report.json").read_text())
    assert (listed["computed"], listed["failed"]) == (1, 2)
    assert not (photos / "out" / "pair-000007").exists()


def test_if_no_pair_can_be_computed_the_first_reason_is_told_and_nothing_is_written(photos: Path) -> None:
    """An earlier result is not lost for nothing."""
    for path in (photos / "left").iterdir():
        path.write_bytes(b"no image")
    with pytest.raises(DataError, match=r"none of the 3 pairs can be computed; the first: .*l2\.png"):
        run_stereo(_job(photos), _Watch())
    assert not (photos / "out").exists()


@pytest.mark.parametrize("error", [DataError("rig.yaml is bad", "calibrate"), SettingsError("--far is bad", "mend it")])
def test_without_a_core_there_is_no_second_try(photos: Path, error: Exception) -> None:
    """A rig that cannot be read is told once, not once per pair."""
    calls = []

    def no_core(size_px: Size) -> StereoCore:
        calls.append(size_px)
        raise error

    with pytest.raises(type(error), match="is bad"):
        run_stereo(_job(photos, no_core), _Watch())
    assert len(calls) == 1


def test_rectified_images_of_several_sizes_each_get_their_own_middle(photos: Path) -> None:
    """The principal point that is not given is the middle of each image, not of the first."""
    wide = _texture(200 + 8)
    cv2.imwrite(str(photos / "left" / "l7.png"), wide[:, :200])
    cv2.imwrite(str(photos / "right" / "r007.png"), wide[:, 8:])
    report = run_stereo(_job(photos), _Watch())
    middles = [pair.geometry.cx_px for pair in report.computed if pair.geometry is not None]
    assert middles == [59.5, 99.5, 59.5]


def test_what_an_earlier_run_left_is_replaced_and_foreign_files_are_refused(photos: Path) -> None:
    """Two pairs replace three, one replaces two; a folder with something foreign inside ends the work."""
    run_stereo(_job(photos), _Watch())
    (photos / "left" / "l2.png").unlink()
    run_stereo(_job(photos), _Watch())
    assert not (photos / "out" / "pair-000002").exists()
    (photos / "left" / "l7.png").unlink()
    run_stereo(_job(photos), _Watch())
    assert not list((photos / "out").glob("pair-*"))
    (photos / "out" / "pair-000003").mkdir()
    with pytest.raises(UnavailableError, match="pair-000003 was not written by an earlier run"):
        run_stereo(_job(photos), _Watch())


def test_progress_names_each_stage_and_pair(photos: Path) -> None:
    """On a terminal one reads what is being done; on large images each stage takes seconds."""
    watch = _Watch()
    run_stereo(_job(photos), watch)
    stages = ("reading", "rectifying", "matching", "computing points", "checking", "writing")
    assert watch.said == [f"{stage} pair-{number:06d}" for number in _SHIFTS for stage in stages]


def test_points_with_y_up_are_the_same_points_turned_by_half_a_turn_about_x(photos: Path) -> None:
    """Y and z change their signs, in the report the words follow."""
    run_stereo(_job(photos), _Watch())
    camera = read_xyz(photos / "out" / "pair-000007" / "xyz.pfm")
    run_stereo(_job(photos), _Watch(), Axes.Y_UP)
    folder = photos / "out" / "pair-000007"
    np.testing.assert_array_equal(read_xyz(folder / "xyz.pfm"), camera * np.array([1, -1, -1], np.float32))
    assert "y up, z backward" in json.loads((folder / "report.json").read_text())["axes"]


def test_a_white_pair_is_told_once_that_it_needs_texture(tmp_path: Path) -> None:
    """The remedy speaks of the scene, and that hardly any pixel matched is no second warning."""
    for side in ("left", "right"):
        cv2.imwrite(str(tmp_path / f"{side}.png"), np.full((64, 120), 255, np.uint8))
    files = pair_files(str(tmp_path / "left.png"), str(tmp_path / "right.png"))
    job = FilePairs(files=files, out=tmp_path / "out", make_core=_core, matcher="sgbm")
    [pair] = run_stereo(job, _Watch()).computed
    assert [concern.code for concern in pair.trust.concerns] == [Code.NO_DEPTH]
    assert "texture" in pair.trust.answer.sentence
    assert pair.remarks_beside_headline == ()


def test_the_headline_counts_the_pixels_that_have_a_point(photos: Path) -> None:
    """All of it is matched, but a far limit of 1 m cuts pairs at 10 / 6 and 10 / 9 m: the headline says what the cloud holds."""
    report = run_stereo(_job(photos, lambda size: _core(size, far_m=1.0)), _Watch())
    for pair in report.computed:
        assert pair.density > 0.7
    sentence = report.computed[2].trust.answer.sentence  # at 0.83 m
    assert f"{report.computed[2].share:.0%} of the pixels have depth" in sentence
    assert report.computed[0].share == 0


def test_pairs_without_depth_are_not_sound(photos: Path) -> None:
    """Images without texture give no depth at all: that is no success."""
    for side, name in (("left", "l"), ("right", "r00")):
        for number in (2, 7):
            cv2.imwrite(str(photos / side / f"{name}{number}.png"), np.full((64, 120), 90, np.uint8))
    (photos / "left" / "l11.png").unlink()
    report = run_stereo(_job(photos), _Watch())
    assert not report.failed
    assert not report.is_sound


class _Impatient(_Watch):
    """Somebody who presses Ctrl-C as soon as two pairs are done."""

    def __call__(self, amount: int = 1) -> None:
        super().__call__(amount)
        if self.done == 2:
            raise KeyboardInterrupt


def test_the_pairs_before_ctrl_c_have_a_report_and_a_page(photos: Path) -> None:
    """Two of three pairs are done: their folders are whole, and the report says that it is not of all pairs."""
    with pytest.raises(KeyboardInterrupt):
        run_stereo(_job(photos), _Impatient())
    out = photos / "out"
    told = json.loads((out / "report.json").read_text())
    assert (told["interrupted_of"], told["computed"]) == (3, 2)
    assert told["headline"].startswith("Interrupted after 2 of 3 pairs.")
    assert [pair["name"] for pair in told["pairs"]] == ["pair-000002", "pair-000007"]
    assert "Interrupted after 2 of 3 pairs" in (out / "index.html").read_text()
    assert not list(out.glob("*.part"))


def test_a_result_that_cannot_be_written_whole_leaves_nothing(photos: Path) -> None:
    """The system takes no file of more than 20 kB: the pictures that could be written are gone, like the maps that could not."""
    for name in ("left/l2.png", "left/l7.png"):
        (photos / name).unlink()
    _, hard = limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        with pytest.raises(OSError, match="too large"):
            run_stereo(_job(photos), _Watch())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [path.name for path in (photos / "out").iterdir()] == [".tandemscan"]
