"""Opens the camera that a URI names. The registry of cameras: each kind is imported only when needed.

Every kind takes the options `rotate` and `flip`. They are read here; no kind sees them.

Other packages register cameras as entry points of the group `tandemscan.cameras`; the name is the URI's scheme in lower case. The entry point is
a callable that takes one CameraRequest, opens the camera and returns a `common.camera.base.Camera`. It raises a SettingsError for an unusable
option, and an UnavailableError for a device that cannot be had.

The images stay as the camera gives them. Whoever decodes them turns them.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, Final, cast
from urllib.parse import parse_qsl

from common.camera.base import Camera
from common.camera.options import EXAMPLE, without_options
from common.errors import SettingsError
from common.orientation import ORIENTING, UPRIGHT, Orientation, orientation_of
from common.program.extensions import make_registered, named, registered_names
from common.protocol.message import CameraDescription
from common.value import value


class TurnedCamera:
    """Passes everything on to the camera itself, whatever its kind offers, except its description.

    Args:
        camera: the camera, open.
        orientation: how it is mounted.
    """

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
    """Return a camera whose description tells its orientation.

    Args:
        camera: an open camera.
        orientation: how it is mounted.
    """
    return camera if orientation == UPRIGHT else cast("Camera", TurnedCamera(camera, orientation))


_CAMERAS: Final = "tandemscan.cameras"


@value(kw_only=True)
class CameraRequest:
    """A request to open another package's camera.

    Attributes:
        uri: the whole URI, for errors.
        path: the part between the scheme and the options.
        options: the options after the question mark, in their order, without `rotate` and `flip`.
        clock: name of this machine's clock, for the stamps.
        now_ns: CLOCK_MONOTONIC now, ns.
    """

    uri: str
    path: str
    options: tuple[tuple[str, str], ...]
    clock: str
    now_ns: int


@value()
class _Kind:
    """Where a kind of camera is implemented.

    Attributes:
        read: takes URI, path, options and clock; returns the settings.
        open: takes the settings and CLOCK_MONOTONIC, ns; returns the camera.
    """

    read: str
    open: str


_KINDS: Final = {
    "replay": _Kind("common.camera.recorded:replay_settings", "common.camera.recorded:open_replay"),
    "v4l2": _Kind("common.camera.v4l2_uri:v4l2_settings", "common.camera.v4l2:V4l2Camera"),
}


_SERVERS: Final = ("http://", "https://")
"""What phone-host takes itself."""


def open_camera(uri: str, clock: str, now_ns: int, example: str = EXAMPLE) -> Camera:
    """Open the camera that a URI names.

    Raises:
        SettingsError: the URI makes no sense.
        UnavailableError: there is no such device or folder.
        DataError: a replay's images are bad.
    """
    scheme, path, options, orientation = _parts(uri, example)
    if scheme in _KINDS:
        settings = _read(scheme, uri, path, options, clock)
        camera: Camera = named(_KINDS[scheme].open)(settings, now_ns)
        return turned(camera, orientation)
    request = CameraRequest(uri=uri, path=path, options=tuple(options.items()), clock=clock, now_ns=now_ns)
    extension: Camera = make_registered(_CAMERAS, scheme, Camera, request)
    return turned(extension, orientation)


def parse_camera(uri: str, clock: str, example: str = EXAMPLE) -> object:
    """Parse a camera URI without opening anything.

    Returns:
        The camera's settings: ReplaySettings or V4l2Settings; None for another package's camera, which parses them when it opens.

    Raises:
        SettingsError: the URI makes no sense.
    """
    scheme, path, options, _ = _parts(uri, example)
    return _read(scheme, uri, path, options, clock) if scheme in _KINDS else None


def parse_orientation(uri: str, example: str = EXAMPLE) -> Orientation:
    """Parse how a camera URI says that the camera is mounted.

    Raises:
        SettingsError: the URI makes no sense.
    """
    return _parts(uri, example)[-1]


def _read(scheme: str, uri: str, path: str, options: dict[str, str], clock: str) -> object:
    settings: object = named(_KINDS[scheme].read)(uri, path, options, clock)
    return settings


def _parts(uri: str, example: str) -> tuple[str, str, dict[str, str], Orientation]:
    """Split scheme, path, options and orientation; check that the scheme is known."""
    scheme, found, rest = uri.partition(":")
    if not found or not (scheme in _KINDS or scheme in registered_names(_CAMERAS)):
        raise _unknown(uri, example)
    path, options = _split(uri, rest)
    if scheme == "replay" and not path:
        raise SettingsError(f"camera {uri!r} names no folder", "name one with images, for example replay:frames?fps=30")
    others = {name: value for name, value in options.items() if name not in ORIENTING}
    return scheme, path, others, orientation_of(options, uri)


def _unknown(uri: str, example: str) -> SettingsError:
    """Return the error for a URI of an unknown kind. A server's address stays out of it, because it may hold a password."""
    if uri.lower().startswith(_SERVERS):
        return SettingsError(
            f"camera {uri.partition('//')[0]}//... is of a kind that only phone-host takes",
            f"give it to phone-host run --camera, and here {example}",
        )
    path = uri.partition("?")[0]
    try:
        is_there = bool(path) and Path(path).exists()
    except (OSError, ValueError):
        is_there = False
    if is_there:
        kind = "v4l2" if Path(path).is_char_device() else "replay"
        return SettingsError(f"camera {uri!r} does not say of which kind it is", f"give '{kind}:{uri}'")
    return SettingsError(f"camera {uri!r} is of an unknown kind", f"give {without_options(example)}")


def _split(uri: str, rest: str) -> tuple[str, dict[str, str]]:
    """Split path and options. A `?` without a following `=` belongs to a glob."""
    path, mark, query = rest.rpartition("?")
    if not mark or "=" not in query:
        return rest, {}
    try:
        return path, dict(parse_qsl(query, keep_blank_values=True, strict_parsing=True))
    except ValueError:
        raise SettingsError(f"camera {uri!r} has options {query!r}", f"give {EXAMPLE}") from None
