"""Reads a calibration of any known kind. Which kind it is, its content tells; its name tells nothing."""

import shlex
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final

import numpy as np

from common.byte_order_mark import without_mark
from common.errors import DataError, SettingsError
from common.files import read_input
from common.places import Kind, kind_of
from phone_host.model import Rectification, Rig
from phone_host.output.calib_txt import is_calib_txt, read_calib_txt
from phone_host.output.rig_files.colmap import CAMERAS, IMAGES, colmap_texts, is_cameras, is_images, read_colmap
from phone_host.output.rig_files.kalibr import euroc_texts, is_euroc, is_kalibr, kalibr_texts, read_euroc, read_kalibr
from phone_host.output.rig_files.opencv import is_opencv, merged, opencv_texts, read_opencv
from phone_host.output.rig_files.rectified import kitti_texts, middlebury_texts, stated_of_geometry
from phone_host.output.rig_files.ros import is_ros, read_ros, ros_texts
from phone_host.output.rig_files.stated import StatedRig, baseline_of, rig_of
from phone_host.output.rig_files.texts import RigText
from phone_host.output.rig_files.tree import Node, read_xml
from phone_host.output.rig_files.yaml_text import read_yaml
from phone_host.output.rig_yaml import read_rig

_MOST_BYTES: Final = 16 << 20
"""Limit for a file. Of these kinds only COLMAP's images.txt grows with the scene; YAML and XML are limited further."""

_MOST_YAML_BYTES: Final = 1 << 20
_NO_UNIT_M: Final = 1.0
_USUAL_BASELINE_M: Final = (0.01, 2.0)
"""From two endoscopes to two cameras on a car's roof."""

_REMEDY: Final = "give files of rig.yaml, ROS, Kalibr, OpenCV, COLMAP, EuRoC, Middlebury, ETH3D or KITTI"


class RigKind(Enum):
    """Whose files hold a calibration. Middlebury's calib.txt is ETH3D's, too."""

    RIG = "rig"
    ROS = "ros"
    KALIBR = "kalibr"
    OPENCV = "opencv"
    OPENCV_XML = "opencv-xml"
    COLMAP = "colmap"
    EUROC = "euroc"
    MIDDLEBURY = "middlebury"
    KITTI = "kitti"


@dataclass(frozen=True, slots=True, eq=False)
class Imported:
    """A calibration that was read.

    Attributes:
        kind: whose it is.
        files: the files that it was read from, left before right where each camera has one.
        rig: the two cameras.
        notes: what was decided for the user, a sentence each.
    """

    kind: RigKind
    files: tuple[Path, ...]
    rig: Rig
    notes: tuple[str, ...] = ()


_IN_FOLDERS: Final = (
    (CAMERAS, IMAGES),
    ("cam0/sensor.yaml", "cam1/sensor.yaml"),
    ("mav0/cam0/sensor.yaml", "mav0/cam1/sensor.yaml"),
    ("left.yaml", "right.yaml"),
    ("intrinsics.yml", "extrinsics.yml"),
    ("camchain.yaml",),
    ("stereo.yml",),
    ("stereo.xml",),
    ("rig.yaml",),
    ("calib.txt",),
    ("calib_cam_to_cam.txt",),
)
"""What a folder that stands for a calibration holds, by the names that the programs give."""

_BINARY_CAMERAS: Final = "cameras.bin"
_BINARY_MODEL: Final = frozenset({_BINARY_CAMERAS, "images.bin"})


def files_of(given: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return the files of a calibration: a folder stands for those in it that have the usual names.

    Raises:
        SettingsError: there are more than two.
        DataError: a folder holds none of those names.
    """
    if len(given) > 2:
        raise SettingsError(f"--import has {len(given)} files", "give one or two: left before right")
    try:
        _require_no_binary(given)
        if len(given) != 1 or kind_of(given[0]) is not Kind.FOLDER:
            return given
        for names in _IN_FOLDERS:
            paths = tuple(given[0] / name for name in names)
            if all(kind_of(path) is Kind.FILE for path in paths):
                return paths
    except OSError as error:  # a circle of links, a name that is too long, a folder that may not be searched
        raise DataError(f"{given[0]} cannot be read ({error.strerror})", _REMEDY) from error
    raise DataError(f"{given[0]} holds no calibration with a usual name", _REMEDY)


def _require_no_binary(given: tuple[Path, ...]) -> None:
    """Refuse COLMAP's binary model, by its names, unless its text lies in the same folder."""
    for path in given:
        folder = path if kind_of(path) is Kind.FOLDER else path.parent
        binary = folder / _BINARY_CAMERAS if path == folder else path
        is_binary = binary.name in _BINARY_MODEL and kind_of(binary) is Kind.FILE
        if is_binary and (path != folder or kind_of(folder / CAMERAS) is not Kind.FILE):
            raise DataError(
                f"{binary} is a binary model of COLMAP",
                "write it as text: colmap model_converter --input_path IN --output_path OUT --output_type TXT",
            )


def read_own_rig(path: Path) -> Rig:
    """Read a rig.yaml; for the calibration of another program, say how to make one of it.

    Raises:
        DataError: as `read_rig`, or it is another program's.
    """
    try:
        return read_rig(path)
    except DataError as error:
        kind = _foreign_kind(path)
        if kind is None:
            raise
        given = shlex.join(map(str, _to_import(path, kind)))
        raise DataError(
            f"{path} is the calibration of another program ({kind.value}), not a rig.yaml",
            f"make one: phone-host calibrate --import {given} --out rig.yaml",
        ) from error


def _foreign_kind(path: Path) -> RigKind | None:
    """Tell by its content whose calibration a file or folder is, or is a part of; None: nobody's, or this program's."""
    try:
        text = _text(files_of((path,))[0])
        if is_cameras(text) or is_images(text):
            return RigKind.COLMAP
        node = _node(text, str(path))
    except DataError:
        return None
    kinds = ((RigKind.ROS, is_ros), (RigKind.EUROC, is_euroc), (RigKind.KALIBR, is_kalibr), (RigKind.OPENCV, is_opencv))
    is_other = node.has("format_version") or text.lstrip().startswith("{")  # JSON is none of them
    return None if is_other else next((kind for kind, is_kind in kinds if is_kind(node)), None)


def _to_import(path: Path, kind: RigKind) -> tuple[Path, ...]:
    """Return what to import for a file that may be one of two: the folder that holds both, if they have the usual names."""
    for folder in (path, path.parent, path.parent.parent):
        with suppress(DataError):
            found = files_of((folder,))
            if kind_of(path) is Kind.FOLDER or (path in found and len(found) > 1):
                return (folder,)
    return (path,) if kind in {RigKind.KALIBR, RigKind.OPENCV} else (path, Path("OTHER"))


def _unusual(rig: Rig) -> tuple[str, ...]:
    """Return a note if hardly any rig is so wide or so narrow."""
    baseline_m = float(np.linalg.norm(rig.t_right_left_m))
    if _USUAL_BASELINE_M[0] <= baseline_m <= _USUAL_BASELINE_M[1]:
        return ()
    return (f"cameras {baseline_m * 1e3:.4g} mm apart are unusual: check the unit of the file's lengths (--unit)",)


def import_rig(
    given: tuple[Path, ...],
    unit_m: float | None = None,
    sizes_px: tuple[tuple[int, int], tuple[int, int]] | None = None,
) -> Imported:
    """Read a calibration.

    Args:
        given: one or two files, or a folder; left before right where each camera has a file.
        unit_m: what 1 of the file's lengths is, m; None: as its kind has it, which is metres but for Middlebury.
        sizes_px: width and height of the left and of the right image, px, where the files do not state them; None: not known.

    Raises:
        SettingsError: the arguments do not fit the kind.
        DataError: a file cannot be read, is of no known kind, or a value in it cannot be; names file and key.
    """
    paths = files_of(given)
    if len(paths) == 1 and is_calib_txt(paths[0]):
        if unit_m is not None:
            raise SettingsError(f"--unit has no meaning for {paths[0]}", "leave it out: calib.txt has its own units")
        return _rectified(paths[0], sizes_px)
    texts = [_text(path) for path in paths]
    kind, stated = _stated(paths, texts)
    if stated is None:
        if unit_m is not None or sizes_px is not None:
            raise SettingsError("--unit and --size have no meaning for a rig.yaml", "leave them out: it states both")
        return Imported(kind, paths, read_rig(paths[0]))
    if kind in {RigKind.KALIBR, RigKind.EUROC, RigKind.COLMAP} and baseline_of(stated) < 0:
        # Numbers name no side. The left camera is the one that stands on the left.
        stated = stated.exchanged()
        aside = f"the second camera stands left of the first: {stated.left.name} is the left one"
        rig = rig_of(stated, _NO_UNIT_M if unit_m is None else unit_m, None if sizes_px is None else sizes_px[::-1])
        return Imported(kind, paths, rig, (*stated.notes, aside, *_unusual(rig)))
    rig = rig_of(stated, _NO_UNIT_M if unit_m is None else unit_m, sizes_px)
    return Imported(kind, paths, rig, (*stated.notes, *_unusual(rig)))


def _rectified(path: Path, sizes_px: tuple[tuple[int, int], tuple[int, int]] | None) -> Imported:
    found = read_calib_txt(path)
    kind = RigKind.MIDDLEBURY if found.cameras.startswith("cam0") else RigKind.KITTI
    stated = stated_of_geometry(found.geometry, found.size_px, str(path), found.cameras)
    rig = rig_of(stated, _NO_UNIT_M, sizes_px)
    return Imported(kind, (path,), rig, (*stated.notes, *_unusual(rig)))


def _text(path: Path) -> str:
    try:
        return without_mark(read_input(path, _MOST_BYTES, _REMEDY)).decode()
    except UnicodeDecodeError as error:
        raise DataError(f"{path} is no text", _REMEDY) from error


def _stated(paths: tuple[Path, ...], texts: list[str]) -> tuple[RigKind, StatedRig | None]:
    """Tell the kind and read it; without a stated rig it is a rig.yaml, which has a reader of its own."""
    names = [str(path) for path in paths]
    if len(texts) == 2:
        for a, b in ((0, 1), (1, 0)):
            if is_cameras(texts[a]) and is_images(texts[b]):
                return RigKind.COLMAP, read_colmap(texts[a], names[a], texts[b], names[b])
    if any(is_cameras(text) or is_images(text) for text in texts):
        raise SettingsError(f"{' and '.join(names)} are half of a COLMAP model", f"give {CAMERAS} and {IMAGES}")
    nodes = tuple(_node(text, name) for text, name in zip(texts, names, strict=True))
    if len(nodes) == 1 and nodes[0].has("format_version") and nodes[0].has("M1"):
        return RigKind.RIG, None
    for kind, is_kind, read in ((RigKind.ROS, is_ros, read_ros), (RigKind.EUROC, is_euroc, read_euroc)):
        if all(is_kind(node) for node in nodes):
            if len(nodes) != 2:
                raise SettingsError(f"{names[0]} is one camera of two", "give the files of both: left before right")
            return kind, read(*nodes)
    if len(nodes) == 1 and is_kalibr(nodes[0]):
        return RigKind.KALIBR, read_kalibr(nodes[0])
    if all(is_opencv(node) for node in nodes):
        kind = RigKind.OPENCV_XML if texts[0].lstrip().startswith("<") else RigKind.OPENCV
        return kind, read_opencv(merged(nodes))
    shown = " and ".join(names)
    raise DataError(f"{shown} {'is no calibration' if len(names) == 1 else 'are not of one calibration'}", _REMEDY)


def _node(text: str, name: str) -> Node:
    if len(text) > _MOST_YAML_BYTES:
        raise DataError(f"{name} is longer than any calibration", _REMEDY)
    if text.lstrip().startswith("# oST version"):
        raise DataError(
            f"{name} is ost.txt of camera_calibration, which is not read",
            "give left.yaml and right.yaml, which lie in the same archive",
        )
    read = read_xml if text.lstrip().startswith("<") else read_yaml
    return Node(name, "", read(text, name))


def export_texts(rig: Rig, rectification: Rectification, kind: RigKind, disparities: int) -> tuple[RigText, ...]:
    """Write a rig as the files of another program.

    Args:
        rig: two cameras.
        rectification: computed from the same rig.
        kind: whose files; not RIG, which has a writer of its own (`write_rig`).
        disparities: N, the number of disparities to search in rectified images, px.

    Raises:
        DataError: that program cannot hold the rig; says what of it.
    """
    writers: dict[RigKind, Callable[[], tuple[RigText, ...]]] = {
        RigKind.ROS: lambda: ros_texts(rig, rectification),
        RigKind.KALIBR: lambda: kalibr_texts(rig),
        RigKind.OPENCV: lambda: opencv_texts(rig, rectification, as_xml=False),
        RigKind.OPENCV_XML: lambda: opencv_texts(rig, rectification, as_xml=True),
        RigKind.COLMAP: lambda: colmap_texts(rig),
        RigKind.EUROC: lambda: euroc_texts(rig),
        RigKind.MIDDLEBURY: lambda: middlebury_texts(rectification, disparities),
        RigKind.KITTI: lambda: kitti_texts(rectification),
    }
    return writers[kind]()
