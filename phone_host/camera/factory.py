"""Camera URI to camera, for the host: what `common` knows, and servers."""

from common.camera import factory as common_factory
from common.camera.base import Camera
from common.frame import ImageSizeError
from common.imagesize import MOST_PIXELS, require_pixels
from phone_host.camera.http_uri import http_settings, is_http


def open_camera(uri: str, clock: str, now_ns: int, most_pixels: int = MOST_PIXELS) -> Camera:
    """Open the camera that a URI names.

    Args:
        uri: as in `examples.EXAMPLE`.
        clock: name of this machine's clock, for the stamps.
        now_ns: CLOCK_MONOTONIC now, ns.
        most_pixels: a camera whose images have more is refused.

    Returns:
        The open camera.

    Raises:
        SettingsError: the URI makes no sense.
        UnavailableError: there is no such device, folder or server.
        DataError: a replay's images are bad, or the images are too large.
    """
    camera = _open(uri, clock, now_ns)
    said = camera.description
    try:
        require_pixels((said.width_px, said.height_px), most_pixels, f"camera {said.name}")
    except ImageSizeError:
        camera.close()
        raise
    return camera


def _open(uri: str, clock: str, now_ns: int) -> Camera:
    if not is_http(uri):
        return common_factory.open_camera(uri, clock, now_ns)
    from phone_host.camera.mjpeg_http import HttpCamera  # noqa: PLC0415 - TLS and all that only where it is of use

    return HttpCamera(http_settings(uri, clock))


def check_camera(uri: str) -> None:
    """Read a camera URI without opening anything.

    Raises:
        SettingsError: the URI makes no sense.
    """
    if is_http(uri):
        http_settings(uri, "")
    else:
        common_factory.parse_camera(uri, "")
