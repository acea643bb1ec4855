"""Calibrations of other programs: what all kinds of files share. Each kind has a file of tests beside this one."""

from pathlib import Path

import pytest

from common.errors import DataError, SettingsError, TandemError
from phone_host.jobs.calibrate.request import EXPORTS
from phone_host.model import Epipolar, Lens
from phone_host.output.calib_txt import read_calib_txt
from phone_host.output.rig_files.imported import RigKind, export_texts, import_rig
from phone_host.output.rig_yaml import read_rig, write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.rig_files import assert_same_rig, exported, fisheye_rig, four_rig, rational_rig
from tests.support.rigs import stacked_rig, unlike_rig

WHOLE = (RigKind.ROS, RigKind.KALIBR, RigKind.OPENCV, RigKind.OPENCV_XML, RigKind.COLMAP, RigKind.EUROC)


def test_the_options_name_every_kind_but_our_own() -> None:
    """--export offers all kinds except rig.yaml, which is always written."""
    assert set(EXPORTS) == {kind.value for kind in RigKind} - {"rig"}


@pytest.mark.parametrize("kind", WHOLE)
def test_what_is_exported_is_read_back_the_same(kind: RigKind, tmp_path: Path) -> None:
    """Two unlike cameras come back with the same pose and the same pixels, by their folder, of the same kind."""
    found = import_rig((exported(tmp_path, four_rig(), kind),))
    assert found.kind is kind
    assert_same_rig(found.rig, four_rig())
    write_rig(tmp_path / "rig.yaml", found.rig, rectify_rig(found.rig))
    assert_same_rig(read_rig(tmp_path / "rig.yaml"), four_rig())


@pytest.mark.parametrize("kind", [RigKind.ROS, RigKind.OPENCV, RigKind.OPENCV_XML, RigKind.COLMAP])
def test_rational_lenses_and_k3_come_back_the_same(kind: RigKind, tmp_path: Path) -> None:
    """Eight coefficients on the left, five on the right."""
    assert_same_rig(import_rig((exported(tmp_path, rational_rig(), kind),)).rig, rational_rig())


@pytest.mark.parametrize("kind", WHOLE)
def test_fisheye_lenses_come_back_as_such(kind: RigKind, tmp_path: Path) -> None:
    """Two fisheye lenses keep their kind and their pixels; taken for k1 k2 p1 p2 they would be off by hundreds."""
    found = import_rig((exported(tmp_path, fisheye_rig(), kind),)).rig
    assert (found.left.lens, found.right.lens) == (Lens.FISHEYE, Lens.FISHEYE)
    assert_same_rig(found, fisheye_rig())


@pytest.mark.parametrize("kind", [RigKind.KALIBR, RigKind.EUROC])
def test_a_lens_that_a_program_does_not_have_is_refused(kind: RigKind) -> None:
    """Kalibr and EuRoC have no k3: the error names the camera and what could hold it."""
    rig = unlike_rig()
    with pytest.raises(DataError, match=rf"{kind.value} cannot hold the left camera.*5 coefficients.*opencv"):
        export_texts(rig, rectify_rig(rig), kind, 64)


@pytest.mark.parametrize("kind", [RigKind.ROS, RigKind.MIDDLEBURY, RigKind.KITTI])
def test_cameras_one_above_the_other_are_refused_where_rows_are_meant(kind: RigKind) -> None:
    """These files are for images whose rows match."""
    rig = stacked_rig(Epipolar.UP)
    with pytest.raises(DataError, match="one above the other"):
        export_texts(rig, rectify_rig(rig), kind, 64)


@pytest.mark.parametrize("kind", [RigKind.MIDDLEBURY, RigKind.KITTI])
def test_calib_txt_is_for_the_images_that_stereo_rectifies(kind: RigKind, tmp_path: Path) -> None:
    """Geometry and size are those of the rectification; as a rig it is two ideal cameras of that size."""
    rectification = rectify_rig(four_rig())
    exported(tmp_path, four_rig(), kind)
    geometry = read_calib_txt(tmp_path / "calib.txt").geometry
    for name in ("focal_px", "baseline_m", "cx_px", "cy_px", "doffs_px"):
        assert getattr(geometry, name) == pytest.approx(getattr(rectification.geometry, name), abs=1e-9)
    size_px = (rectification.width_px, rectification.height_px)
    found = import_rig((tmp_path / "calib.txt",), sizes_px=None if kind is RigKind.MIDDLEBURY else (size_px, size_px))
    assert found.kind is kind
    again = rectify_rig(found.rig)
    assert (again.width_px, again.height_px) == size_px
    assert again.geometry.baseline_m == pytest.approx(geometry.baseline_m)


def test_folders_and_files_that_are_none_are_refused(tmp_path: Path) -> None:
    """An empty folder, a picture, a missing file, three files, half a model."""
    (tmp_path / "a.png").write_bytes(b"\x89PNG\xff")
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 640 480 500 500 320 240\n")
    (tmp_path / "some.yaml").write_text("a: 1\n")
    empty = tmp_path / "empty"
    empty.mkdir()
    (tmp_path / "circle").symlink_to("circle")
    cases: list[tuple[tuple[Path, ...], type[TandemError], str]] = [
        ((empty,), DataError, "no calibration with a usual name"),
        ((tmp_path / "a.png",), DataError, "is no text"),
        ((tmp_path / "b.yaml",), DataError, "cannot be read"),
        ((empty, empty, empty), SettingsError, "has 3 files"),
        ((tmp_path / "cameras.txt",), SettingsError, "half of a COLMAP model"),
        ((tmp_path / "some.yaml",), DataError, "is no calibration"),
        ((tmp_path / "circle",), DataError, "circle cannot be read"),
        ((tmp_path / ("a" * 5000),), DataError, "cannot be read"),
    ]
    for given, error, said in cases:
        with pytest.raises(error, match=said):
            import_rig(given)
