"""A camera that is mounted turned: any camera, whose description also says how its images become upright.

The images stay as the camera gives them. Whoever decodes them turns them.
"""

from dataclasses import replace
from typing import Any, cast

from common.camera.base import Camera
from common.orientation import UPRIGHT, Orientation
from common.protocol.message import CameraDescription


class TurnedCamera:
    """Passes everything on to the camera itself, whatever its kind offers, except its description."""

    def __init__(self, camera: Camera, orientation: Orientation) -> None:
        self._camera = camera
        self._orientation = orientation

    @property
    def description(self) -> CameraDescription:
        """See Camera."""
        return replace(self._camera.description, orientation=self._orientation)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the camera offers
        return getattr(self._camera, name)


def turned(camera: Camera, orientation: Orientation) -> Camera:
    """Return a camera whose description tells its orientation."""
    return camera if orientation == UPRIGHT else cast("Camera", TurnedCamera(camera, orientation))
