"""Finds out which cameras took the images of a calibration: a run saves that beside them, in cameras.json."""

import os
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

from common.camera_identity import UNKNOWN_CAMERA, RememberedCamera
from common.errors import DataError, SettingsError
from common.imagesize.head import MOST_PIXELS, size_text
from common.orientation import UPRIGHT, Orientation
from common.places import Kind, kind_of
from phone_host.model import Rig
from phone_host.output.cameras_json import CAMERAS_NAME, read_cameras
from phone_host.stereo.images import open_image
from phone_host.stereo.view_files import ViewFiles

Size = tuple[int, int]
Cameras = tuple[RememberedCamera, RememberedCamera]

_FIRST: Final = 5
"""Pairs whose headers tell the size of all: one of another size among them is an exception."""


def cameras_beside(files: ViewFiles, mounted: tuple[Orientation, Orientation]) -> tuple[Path, Cameras] | None:
    """Read the cameras.json that lies in the folder of the left or of the right images, or in their common one.

    Returns:
        The file and its cameras; None if there is none.

    Raises:
        DataError: the file is not valid, two such files differ, or its cameras' images have another size than these.
        SettingsError: the user gives an orientation, but a run has saved these images upright.
    """
    found = [
        path for path in (folder / CAMERAS_NAME for folder in _folders(files)) if kind_of(path) is not Kind.MISSING
    ]
    if not found:
        return None
    path, cameras = found[0], read_cameras(found[0])
    for other in found[1:]:
        if read_cameras(other) != cameras:
            raise DataError(f"{path} and {other} name different cameras", "delete the one that is not of these images")
    if mounted != (UPRIGHT, UPRIGHT):
        raise SettingsError(
            f"the images beside {path} were saved upright, and would be turned once more",
            "leave out --rotate-left, --rotate-right, --flip-left and --flip-right",
        )
    sizes_px = first_sizes(files)
    if sizes_px is not None:
        require_sizes(path, cameras, sizes_px)
    return path, cameras


def require_sizes(path: Path, cameras: Cameras, sizes_px: tuple[Size, Size]) -> None:
    """Check that images can come from the cameras of a cameras.json.

    Raises:
        DataError: their size differs.
    """
    for side, camera, size_px in zip(("left", "right"), cameras, sizes_px, strict=True):
        if camera.upright_px != size_px:
            raise DataError(
                f"{path}: the {side} camera gives images of {size_text(camera.upright_px)} px, these are"
                f" {size_text(size_px)} px",
                "give the images of that run, or delete the file if other cameras took these",
            )


def with_cameras(rig: Rig, cameras: Cameras | None, mounted: tuple[Orientation, Orientation]) -> Rig:
    """Return a rig that states its cameras, as far as they are known."""
    if cameras is not None:
        return replace(rig, left_camera=cameras[0], right_camera=cameras[1])
    states = []
    for model, turn in zip((rig.left, rig.right), mounted, strict=True):
        width_px, height_px = turn.turned_size((model.width_px, model.height_px))
        states.append(None if turn == UPRIGHT else RememberedCamera(UNKNOWN_CAMERA, width_px, height_px, turn))
    return replace(rig, left_camera=states[0], right_camera=states[1])


def _folders(files: ViewFiles) -> list[Path]:
    """Return the folders in which a cameras.json may lie, each once: those of each side's images, and their common one."""
    sides = [
        {path.parent.absolute() for path in paths} for paths in zip(*((a, b) for _, a, b in files.pairs), strict=True)
    ]
    groups = [*sides, set().union(*sides)]
    return list(dict.fromkeys(Path(os.path.commonpath(group)) for group in groups if group))


def first_sizes(
    files: ViewFiles, most_pixels: int = MOST_PIXELS, mounted: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT)
) -> tuple[Size, Size] | None:
    """Return the sizes that most of the first pairs have, upright; None if none of them can be read."""
    sizes = Counter[tuple[Size, Size]]()
    for _, *both in files.pairs[:_FIRST]:
        with suppress(DataError):
            left, right = (open_image(path, most_pixels, turn) for path, turn in zip(both, mounted, strict=True))
            sizes[left.size_px, right.size_px] += 1
    return sizes.most_common(1)[0][0] if sizes else None
