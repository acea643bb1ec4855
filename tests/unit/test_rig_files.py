"""Calibrations of other programs: what they mean, said by their own documentation and by OpenCV and COLMAP as oracles."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from common.errors import DataError, SettingsError, TandemError
from phone_host.model import CameraModel, Epipolar, Lens, Rig
from phone_host.output.calib_txt import read_calib_txt
from phone_host.output.rig_files.imported import Imported, RigKind, export_texts, import_rig
from phone_host.output.rig_yaml import read_rig, write_rig
from phone_host.stereo.rectify import rectify_rig
from phone_host.verbs.calibrate.arguments import EXPORTS
from tests.support.rigs import points_seen_by_both, project_points, stacked_rig, unlike_rig

WHOLE = (RigKind.ROS, RigKind.KALIBR, RigKind.OPENCV, RigKind.OPENCV_XML, RigKind.COLMAP, RigKind.EUROC)
"""Kinds that hold both cameras and their pose; the others are for rectified images."""


def _four(model: CameraModel) -> CameraModel:
    return replace(model, distortion=model.distortion[:4])


def _rig() -> Rig:
    """Two unlike cameras whose lenses all kinds can hold: k1 k2 p1 p2."""
    rig = unlike_rig()
    return replace(rig, left=_four(rig.left), right=_four(rig.right))


def _rational() -> Rig:
    rig = unlike_rig()
    distortion = np.array([0.3, 0.1, 0.001, -0.0005, 0.01, 0.5, 0.2, 0.02])
    return replace(rig, left=replace(rig.left, distortion=distortion))


def _fisheye() -> Rig:
    rig = _rig()
    distortion = np.array([-0.02, 0.003, -0.001, 0.0005])
    left, right = (replace(model, distortion=distortion, lens=Lens.FISHEYE) for model in (rig.left, rig.right))
    return replace(rig, left=left, right=right)


def _export(folder: Path, rig: Rig, kind: RigKind) -> Path:
    for each in export_texts(rig, rectify_rig(rig), kind, 64):
        path = folder / each.name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text(each.text)
    return folder


def _assert_same(found: Rig, rig: Rig, *, atol: float = 1e-12) -> None:
    """Both project the same points to the same pixels."""
    np.testing.assert_allclose(found.R_right_left, rig.R_right_left, atol=atol)
    np.testing.assert_allclose(found.t_right_left_m, rig.t_right_left_m, atol=atol)
    for a, b in ((found.left, rig.left), (found.right, rig.right)):
        assert (a.width_px, a.height_px) == (b.width_px, b.height_px)
    points = points_seen_by_both(rig, 50, seed=1).points_m
    for ours, theirs in zip(project_points(points, found), project_points(points, rig), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-8)


def test_the_options_name_every_kind_but_our_own() -> None:
    """--export offers all kinds except rig.yaml, which is always written."""
    assert set(EXPORTS) == {kind.value for kind in RigKind} - {"rig"}


@pytest.mark.parametrize("kind", WHOLE)
def test_what_is_exported_is_read_back_the_same(kind: RigKind, tmp_path: Path) -> None:
    """Two unlike cameras come back with the same pose and the same pixels, by their folder, of the same kind."""
    found = import_rig((_export(tmp_path, _rig(), kind),))
    assert found.kind is kind
    _assert_same(found.rig, _rig())
    write_rig(tmp_path / "rig.yaml", found.rig, rectify_rig(found.rig))
    _assert_same(read_rig(tmp_path / "rig.yaml"), _rig())


@pytest.mark.parametrize("kind", [RigKind.ROS, RigKind.OPENCV, RigKind.OPENCV_XML, RigKind.COLMAP])
def test_rational_lenses_and_k3_come_back_the_same(kind: RigKind, tmp_path: Path) -> None:
    """Eight coefficients on the left, five on the right."""
    _assert_same(import_rig((_export(tmp_path, _rational(), kind),)).rig, _rational())


@pytest.mark.parametrize("kind", WHOLE)
def test_fisheye_lenses_come_back_as_such(kind: RigKind, tmp_path: Path) -> None:
    """Two fisheye lenses keep their kind and their pixels; taken for k1 k2 p1 p2 they would be off by hundreds."""
    found = import_rig((_export(tmp_path, _fisheye(), kind),)).rig
    assert (found.left.lens, found.right.lens) == (Lens.FISHEYE, Lens.FISHEYE)
    _assert_same(found, _fisheye())


def test_one_fisheye_lens_of_two_is_refused_where_one_word_stands_for_both() -> None:
    """OpenCV's file says fisheye_model for the whole rig."""
    rig = replace(_fisheye(), right=_rig().right)
    with pytest.raises(DataError, match="opencv cannot hold a rig with one fisheye lens"):
        export_texts(rig, rectify_rig(rig), RigKind.OPENCV, 64)


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
    rectification = rectify_rig(_rig())
    _export(tmp_path, _rig(), kind)
    geometry = read_calib_txt(tmp_path / "calib.txt").geometry
    for name in ("focal_px", "baseline_m", "cx_px", "cy_px", "doffs_px"):
        assert getattr(geometry, name) == pytest.approx(getattr(rectification.geometry, name), abs=1e-9)
    size_px = (rectification.width_px, rectification.height_px)
    found = import_rig((tmp_path / "calib.txt",), sizes_px=None if kind is RigKind.MIDDLEBURY else (size_px, size_px))
    assert found.kind is kind
    again = rectify_rig(found.rig)
    assert (again.width_px, again.height_px) == size_px
    assert again.geometry.baseline_m == pytest.approx(geometry.baseline_m)


@pytest.mark.parametrize("name", ["stereo.yml", "stereo.xml"])
def test_opencv_reads_what_is_exported_for_it(name: str, tmp_path: Path) -> None:
    """cv2.FileStorage gives the matrices, and its rectification maps built from them lead to the same pixels as ours."""
    rig, kind = _rational(), RigKind.OPENCV if name.endswith("yml") else RigKind.OPENCV_XML
    made = rectify_rig(rig)
    storage = cv2.FileStorage(str(_export(tmp_path, rig, kind) / name), cv2.FILE_STORAGE_READ)
    keys = {key: storage.getNode(key).mat() for key in ("M1", "D1", "M2", "D2", "R", "T", "R1", "R2", "P1", "P2", "Q")}
    np.testing.assert_array_equal(keys["R"], rig.R_right_left)
    assert storage.getNode("right_image_width").real() == rig.right.width_px
    for n, model, turn in (("1", rig.left, made.R_left), ("2", rig.right, made.R_right)):
        size = (made.width_px, made.height_px)
        theirs = cv2.initUndistortRectifyMap(
            keys[f"M{n}"], keys[f"D{n}"], keys[f"R{n}"], keys[f"P{n}"], size, cv2.CV_32FC1
        )
        ours = cv2.initUndistortRectifyMap(model.matrix, model.distortion, turn, made.P_left, size, cv2.CV_32FC1)
        np.testing.assert_allclose(theirs[0], ours[0], atol=1e-3)
        np.testing.assert_allclose(theirs[1], ours[1], atol=1e-3)


@pytest.mark.parametrize("name", ["a.yml", "a.xml"])
def test_what_opencv_writes_is_read(name: str, tmp_path: Path) -> None:
    """A file written by cv2.FileStorage with the keys of OpenCV's sample, which states no size and counts T in squares."""
    rig = _rig()
    storage = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_WRITE)
    for key, matrix in {
        "M1": rig.left.matrix, "D1": rig.left.distortion.reshape(1, -1), "M2": rig.right.matrix,
        "D2": rig.right.distortion.reshape(-1, 1), "R": rig.R_right_left, "T": rig.t_right_left_m.reshape(3, 1) / 0.025,
    }.items():  # fmt: skip
        storage.write(key, matrix)
    storage.release()
    path = (tmp_path / name,)
    with pytest.raises(DataError, match=r"M1 does not state the images' size: add --size"):
        import_rig(path, 0.025)
    _assert_same(import_rig(path, 0.025, ((640, 480), (1280, 720))).rig, rig, atol=1e-9)


def test_two_files_of_opencvs_sample_are_one_calibration(tmp_path: Path) -> None:
    """intrinsics.yml and extrinsics.yml, in any order; a file with another M1 is refused."""
    whole = (_export(tmp_path, _rig(), RigKind.OPENCV) / "stereo.yml").read_text()
    head, _, pose = whole.partition("R: ")
    (tmp_path / "intrinsics.yml").write_text(head)
    (tmp_path / "extrinsics.yml").write_text(f"%YAML:1.0\n---\nR: {pose}")
    paths = tmp_path / "extrinsics.yml", tmp_path / "intrinsics.yml"
    _assert_same(import_rig(paths).rig, _rig())
    (tmp_path / "stereo.yml").write_text(whole.replace("525.0", "526.0"))
    with pytest.raises(DataError, match="has another M1 than"):
        import_rig((paths[1], tmp_path / "stereo.yml"))


def test_ros_files_hold_a_rectification_that_ros_understands(tmp_path: Path) -> None:
    """CameraInfo's own words: a point of the rectified axes projects by P, the right P[0, 3] is -f b, and rows agree."""
    rig = _rig()
    _export(tmp_path, rig, RigKind.ROS)
    seen = points_seen_by_both(rig, 40, seed=2)
    pixels = []
    for name, at, points in (("left", 0, seen.points_m), ("right", 1, seen.points_m)):
        lines = (tmp_path / f"{name}.yaml").read_text().splitlines()
        data = [_numbers(line) for line in lines if line.strip().startswith("data:")]
        matrix, distortion, turn, projection = (
            data[0].reshape(3, 3),
            data[1],
            data[2].reshape(3, 3),
            data[3].reshape(3, 4),
        )
        raw = (seen.left_px, seen.right_px)[at].reshape(-1, 1, 2)
        flat = cv2.undistortPointsIter(raw, matrix, distortion, turn, projection[:, :3], (3, 100, 1e-12))
        pixels.append(np.asarray(flat).reshape(-1, 2))
        rectified = points @ rectify_rig(rig).R_left.T
        homogeneous = np.column_stack([rectified, np.ones(len(points))]) @ projection.T
        np.testing.assert_allclose(homogeneous[:, :2] / homogeneous[:, 2:], pixels[-1], atol=1e-4)
        assert projection[0, 3] == pytest.approx(-projection[0, 0] * np.linalg.norm(rig.t_right_left_m) * at)
    np.testing.assert_allclose(pixels[0][:, 1], pixels[1][:, 1], atol=1e-4)


def _numbers(line: str) -> NDArray[np.float64]:
    return np.array([float(word) for word in line.partition(":")[2].strip(" []").split(",")])


def test_ros_topics_are_read_under_their_own_names(tmp_path: Path) -> None:
    """What `ros2 topic echo` prints: width, height, k, d, r, p."""
    _export(tmp_path, _rig(), RigKind.ROS)
    names = {"image_width": "width", "image_height": "height", "camera_matrix": "k", "distortion_coefficients": "d"}
    names |= {"rectification_matrix": "r", "projection_matrix": "p"}
    for side in ("left", "right"):
        text = (tmp_path / f"{side}.yaml").read_text()
        for key, topic in names.items():
            text = text.replace(f"{key}:", f"{topic}:")
        (tmp_path / f"{side}.yaml").write_text(text)
    _assert_same(import_rig((tmp_path,)).rig, _rig())


# As the Kalibr wiki shows it, with numbers of our own: the right camera 0.12 m at +x of cam0, turned by 90 degrees about z.
KALIBR = """cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.1, 0.01, 0.0, 0.0]
  distortion_model: radtan
  intrinsics: [400.0, 401.0, 320.0, 240.0]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.0, -1.0, 0.0, 0.0]
  - [1.0, 0.0, 0.0, -0.12]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [0.2, -0.3, 0.001, 0.002]
  distortion_model: radtan
  intrinsics: [500.0, 502.0, 330.0, 250.0]
  resolution: [640, 480]
  rostopic: /cam1/image_raw
"""


def _kalibr(tmp_path: Path, text: str = KALIBR) -> Imported:
    path = tmp_path / "camchain.yaml"
    path.write_text(text)
    return import_rig((path,))


def test_kalibrs_pose_takes_points_of_cam0_to_cam1(tmp_path: Path) -> None:
    """T_cn_cnm1 of the wiki: p1 = T p0, so (0.12, 0, 1) of cam0 is (0, 0, 1) of cam1."""
    rig = _kalibr(tmp_path).rig
    point = rig.R_right_left @ np.array([0.12, 0.0, 1.0]) + rig.t_right_left_m
    np.testing.assert_allclose(point, [0, 0, 1], atol=1e-12)
    assert rig.left.matrix.tolist() == [[400, 0, 320], [0, 401, 240], [0, 0, 1]]
    assert rig.right.distortion.tolist() == [0.2, -0.3, 0.001, 0.002]


def test_cameras_without_sides_are_exchanged_and_it_is_said(tmp_path: Path) -> None:
    """cam1 at -x of cam0 becomes the left camera; with a third camera a note says which two are taken."""
    pose = KALIBR.replace("- [0.0, -1.0, 0.0, 0.0]", "- [1, 0, 0, 0.12]").replace(
        "- [1.0, 0.0, 0.0, -0.12]", "- [0, 1, 0, 0]"
    )
    found = _kalibr(tmp_path, pose + "cam2:\n  camera_model: omni\n")
    assert found.rig.left.matrix[0, 0] == 500
    np.testing.assert_allclose(found.rig.t_right_left_m, [-0.12, 0, 0])
    assert len(found.notes) == 2
    assert "cam1 is the left one" in found.notes[1]


def test_euroc_poses_are_of_the_body(tmp_path: Path) -> None:
    """p_body = T_BS p_camera: cameras at y = +0.05 and y = -0.06 of a body whose -y is the cameras' x are 0.11 m apart in x."""
    for number, y in ((0, 0.05), (1, -0.06)):
        folder = tmp_path / f"cam{number}"
        folder.mkdir()
        (folder / "sensor.yaml").write_text(
            "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
            f"  data: [0.0, 0.0, 1.0, 0.2,\n   -1.0, 0.0, 0.0, {y},\n   0.0, -1.0, 0.0, 0.0,\n   0.0, 0.0, 0.0, 1.0]\n"
            "rate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [450.0, 451.0, 370.0, 250.0] # fu fv\n"
            "distortion_model: radial-tangential\ndistortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]\n"
        )
    found = import_rig((tmp_path,))
    assert found.kind is RigKind.EUROC
    np.testing.assert_allclose(found.rig.t_right_left_m, [-0.11, 0, 0], atol=1e-12)
    with pytest.raises(SettingsError, match="is one camera of two"):
        import_rig((tmp_path / "cam0" / "sensor.yaml",))


@pytest.fixture
def colmap_folder(tmp_path: Path) -> Iterator[Path]:
    """An ETH3D-like model: two PINHOLE cameras, metres, points behind each image."""
    (tmp_path / "cameras.txt").write_text(
        "# a comment\n3 PINHOLE 940 490 540.5 541.5 470.5 245.5\n7 SIMPLE_RADIAL 940 490 540 470 245 -0.1\n"
    )
    (tmp_path / "images.txt").write_text(
        "# a comment\n2 1 0 0 0 -0.06 0 0 7 im1.png\n\n1 1 0 0 0 0 0 0 3 im0 left.png\n10.5 20.5 -1 3 4 7\n"
    )
    yield tmp_path  # noqa: PT022


def test_colmaps_first_pixel_has_its_centre_at_a_half(colmap_folder: Path) -> None:
    """Principal points are half a pixel less than in the file; images come in the order of their ids."""
    rig = import_rig((colmap_folder / "images.txt", colmap_folder / "cameras.txt")).rig
    assert rig.left.matrix.tolist() == [[540.5, 0, 470], [0, 541.5, 245], [0, 0, 1]]
    assert rig.right.matrix.tolist() == [[540, 0, 469.5], [0, 540, 244.5], [0, 0, 1]]
    assert rig.right.distortion.tolist() == [-0.1, 0, 0, 0]
    np.testing.assert_allclose(rig.t_right_left_m, [-0.06, 0, 0])


@pytest.mark.parametrize("rig", [_rig(), _rational()], ids=["four", "rational"])
def test_colmap_sees_the_same_pixels(rig: Rig, tmp_path: Path) -> None:
    """COLMAP reads the exported model and projects points to the pixels of cv2.projectPoints, half a pixel further."""
    pycolmap: Any = pytest.importorskip("pycolmap", reason="pycolmap has no wheel for this machine")
    _export(tmp_path, rig, RigKind.COLMAP)
    model = pycolmap.Reconstruction()
    model.read_text(str(tmp_path))
    seen = points_seen_by_both(rig, 40, seed=3)
    for id_, pixels in ((1, seen.left_px), (2, seen.right_px)):
        image = model.images[id_]
        pose = image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world
        theirs = model.cameras[image.camera_id].img_from_cam(pose * seen.points_m)
        np.testing.assert_allclose(np.asarray(theirs), pixels + 0.5, atol=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("camera_model: pinhole", "camera_model: omni", "cam0.camera_model is 'omni'"),
        ("distortion_model: radtan", "distortion_model: fov", "cam0.distortion_model is 'fov'"),
        ("[-0.1, 0.01, 0.0, 0.0]", "[-0.1, 0.01]", "cam0.distortion_coeffs has 2 values"),
        ("[400.0, 401.0, 320.0, 240.0]", "[nan, 401.0, 320.0, 240.0]", "cam0.intrinsics holds 'nan'"),
        ("[400.0, 401.0, 320.0, 240.0]", "[400.0, 401.0, 320.0]", "cam0.intrinsics has 3 values"),
        ("[400.0, 401.0, 320.0, 240.0]", "[0.4, 401.0, 320.0, 240.0]", "cam0 has a focal length of 0.4 px"),
        ("[400.0, 401.0, 320.0, 240.0]", "[400.0, 401.0, 3200.0, 240.0]", "cam0 has its principal point at 3200"),
        ("[640, 480]", "[640.5, 480]", "cam0.resolution holds 640.5"),
        ("  resolution: [640, 480]\n", "", "cam0.resolution is missing"),
        ("- [1.0, 0.0, 0.0, -0.12]", "- [0.9, 0.0, 0.0, -0.12]", "cam1.T_cn_cnm1 holds no rotation"),
        ("- [1.0, 0.0, 0.0, -0.12]", "- [-1.0, 0.0, 0.0, -0.12]", "cam1.T_cn_cnm1 holds no rotation"),
        ("- [1.0, 0.0, 0.0, -0.12]", "- [1.0, 0.0, 0.0, -120]", "cam1.T_cn_cnm1 puts the cameras 120 m apart"),
        ("- [1.0, 0.0, 0.0, -0.12]", "- [1.0, 0.0, 0.0, 0]", "cam1.T_cn_cnm1 puts the cameras 0 m apart"),
        ("  - [0.0, 0.0, 0.0, 1.0]\n", "", "cam1.T_cn_cnm1 has 3 rows"),
        ("- [0.0, 0.0, 0.0, 1.0]", "- [0.0, 0.0, 0.0, 2.0]", "cam1.T_cn_cnm1 has another last row"),
        ("cam1:", "camera1:", "cam1 is missing"),
        ("cam0:", "camera0:", "is no calibration"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_file_and_key(old: str, new: str, said: str, tmp_path: Path) -> None:
    """Each value is checked: one line that names camchain.yaml and the key."""
    with pytest.raises(DataError) as caught:
        _kalibr(tmp_path, KALIBR.replace(old, new, 1))
    assert said in caught.value.problem
    assert "camchain.yaml" in caught.value.problem
    assert caught.value.remedy


def test_millimetres_are_told_by_the_unit(tmp_path: Path) -> None:
    """The same chain in mm is 0.12 m with --unit 1mm."""
    path = tmp_path / "camchain.yaml"
    path.write_text(KALIBR.replace("-0.12", "-120"))
    assert np.linalg.norm(import_rig((path,), 0.001).rig.t_right_left_m) == pytest.approx(0.12)


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("images.txt", "1 1 0 0 0 0 0 0 3", "1 2 0 0 0 0 0 0 3", "image 1 has a quaternion of length 2"),
        ("images.txt", "0 0 3 im0", "0 0 4 im0", "image 1 is of camera 4"),
        ("images.txt", "2 1 0 0 0 -0.06 0 0 7 im1.png\n\n", "", "has 1 image"),
        ("cameras.txt", "PINHOLE 940", "FOV 940", "camera 3 is a FOV"),
        ("cameras.txt", "541.5 ", "", "camera 3 has 3 values"),
        ("cameras.txt", "7 SIMPLE", "3 SIMPLE", "camera 3 is there twice"),
    ],
)
def test_a_bad_colmap_model_is_refused(colmap_folder: Path, file: str, old: str, new: str, said: str) -> None:
    """One line that names the file and the id."""
    path = colmap_folder / file
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(DataError, match=said):
        import_rig((colmap_folder,))


def test_ros_halves_of_two_calibrations_are_refused(tmp_path: Path) -> None:
    """Rectified cameras share focal length and rows; a camera calibrated alone has no baseline."""
    folder = _export(tmp_path, _rig(), RigKind.ROS)
    right = (folder / "right.yaml").read_text()
    with pytest.raises(DataError, match="has no baseline"):
        import_rig((folder / "left.yaml", folder / "left.yaml"))
    coarse = replace(_rig().left, matrix=np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]))
    other = _export(tmp_path / "other", replace(_rig(), left=coarse), RigKind.ROS)
    with pytest.raises(DataError, match=r"right.yaml: projection_matrix has another fx"):
        import_rig((other / "left.yaml", folder / "right.yaml"))
    (folder / "right.yaml").write_text(right.replace("plumb_bob", "thin_prism"))
    with pytest.raises(DataError, match=r"distortion_model is 'thin_prism': read are plumb_bob, rational_polynomial"):
        import_rig((folder,))


def test_folders_and_files_that_are_none_are_refused(tmp_path: Path) -> None:
    """An empty folder, a picture, a missing file, three files, half a model."""
    (tmp_path / "a.png").write_bytes(b"\x89PNG\xff")
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 640 480 500 500 320 240\n")
    (tmp_path / "some.yaml").write_text("a: 1\n")
    empty = tmp_path / "empty"
    empty.mkdir()
    cases: list[tuple[tuple[Path, ...], type[TandemError], str]] = [
        ((empty,), DataError, "no calibration with a usual name"),
        ((tmp_path / "a.png",), DataError, "is no text"),
        ((tmp_path / "b.yaml",), DataError, "cannot be read"),
        ((empty, empty, empty), SettingsError, "has 3 files"),
        ((tmp_path / "cameras.txt",), SettingsError, "half of a COLMAP model"),
        ((tmp_path / "some.yaml",), DataError, "is no calibration"),
    ]
    for given, error, said in cases:
        with pytest.raises(error, match=said):
            import_rig(given)
