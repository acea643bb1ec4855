"""Opens the host's cameras by URI: those that `common` knows, servers, and browsers that have the page open."""

from typing import Final

from common.camera import factory as common_factory
from common.camera.base import Camera
from common.camera.factory import turned
from common.errors import SettingsError
from common.frame import ImageSizeError
from common.imagesize.head import MOST_PIXELS, require_pixels
from common.orientation import Orientation
from common.program.extensions import named
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.uris import (
    EXAMPLE,
    browser_settings,
    http_settings,
    is_browser,
    is_http,
    without_orientation,
)

_HTTP: Final = "phone_host.camera.mjpeg_http:HttpCamera"
"""Named, not imported: TLS and its dependencies are loaded only if a server is asked for."""

_REPLAYED: Final = "common.camera.recorded:require_replayed"
_BROWSER: Final = "phone_host.camera.browser:BrowserCamera"


def open_camera(
    uri: str, clock: str, now_ns: int, most_pixels: int = MOST_PIXELS, feed: BrowserFeed | None = None
) -> Camera:
    """Open the camera that a URI names.

    Args:
        uri: as in `examples.EXAMPLE`.
        clock: name of this machine's clock, for the stamps.
        now_ns: CLOCK_MONOTONIC now, ns.
        most_pixels: largest accepted image size, pixels.
        feed: brings the browsers that open the page; None: there is no page.

    Raises:
        SettingsError: the URI is invalid.
        UnavailableError: there is no such device, folder or server, or no browser comes.
        DataError: a replay's images are bad, or the images are too large.
    """
    camera = _open(uri, clock, now_ns, feed)
    said = camera.description
    try:
        require_pixels((said.width_px, said.height_px), most_pixels, f"camera {said.name}")
    except ImageSizeError:
        camera.close()
        raise
    return camera


def _open(uri: str, clock: str, now_ns: int, feed: BrowserFeed | None) -> Camera:
    if not is_http(uri) and not is_browser(uri):
        return common_factory.open_camera(uri, clock, now_ns, EXAMPLE)
    address, orientation = without_orientation(uri)
    camera: Camera
    if is_http(uri):
        camera = named(_HTTP)(http_settings(address, clock))
    else:
        settings = browser_settings(address, clock)
        camera = named(_BROWSER)(settings, with_page(feed), now_ns)
    return turned(camera, orientation)


def with_page(feed: BrowserFeed | None) -> BrowserFeed:
    """Return what brings browsers.

    Raises:
        SettingsError: nothing does.
    """
    if feed is None:
        raise SettingsError(
            "camera browser: comes with the page, and none is served here",
            "use phone-host serve, or add --serve to phone-host run",
        )
    return feed


def check_camera(uri: str) -> None:
    """Check a camera URI without opening anything.

    Raises:
        SettingsError: the URI is invalid.
    """
    if is_http(uri):
        http_settings(without_orientation(uri)[0], "")
    elif is_browser(uri):
        browser_settings(without_orientation(uri)[0], "")
    else:
        common_factory.parse_camera(uri, "", EXAMPLE)


def require_replayed(uri: str) -> None:
    """Refuse a camera that replays what is not there. Any other camera may be plugged in, or begin to answer, later.

    Raises:
        SettingsError: the URI is invalid.
        UnavailableError: there is no such folder or file.
        DataError: there is no image in it.
    """
    if not is_http(uri) and not is_browser(uri):
        named(_REPLAYED)(common_factory.parse_camera(uri, "", EXAMPLE))


def camera_orientation(uri: str) -> Orientation:
    """Return how a camera URI says that the camera is mounted, without opening anything.

    Raises:
        SettingsError: the URI is invalid.
    """
    is_ours = is_http(uri) or is_browser(uri)
    return without_orientation(uri)[1] if is_ours else common_factory.parse_orientation(uri, EXAMPLE)
