"""Opens the camera that a URI names. The registry of cameras: each kind is imported only when needed.

Every kind takes the options `rotate` and `flip`. They are read here; no kind sees them.

Other packages register cameras as entry points of the group `tandemscan.cameras`; the name is the URI's scheme in lower case. The entry point is
a callable that takes one CameraRequest, opens the camera and returns a `common.camera.base.Camera`. It raises a SettingsError for an unusable
option, and an UnavailableError for a device that cannot be had.
"""

from dataclasses import dataclass
from typing import Final
from urllib.parse import parse_qsl

from common.camera.base import Camera
from common.camera.options import EXAMPLE
from common.camera.turned import turned
from common.errors import SettingsError
from common.orientation import ORIENTING, Orientation, orientation_of
from common.program.extensions import make_registered, named, registered_names

_CAMERAS: Final = "tandemscan.cameras"


@dataclass(frozen=True, slots=True, kw_only=True)
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


@dataclass(frozen=True, slots=True)
class _Kind:
    """Where a kind of camera is implemented.

    Attributes:
        read: takes URI, path, options and clock; returns the settings.
        open: takes the settings and CLOCK_MONOTONIC, ns; returns the camera.
    """

    read: str
    open: str


_KINDS: Final = {
    "replay": _Kind("common.camera.replay_uri:replay_settings", "common.camera.replay:ReplayCamera"),
    "v4l2": _Kind("common.camera.v4l2_uri:v4l2_settings", "common.camera.v4l2:V4l2Camera"),
}


def open_camera(uri: str, clock: str, now_ns: int) -> Camera:
    """Open the camera that a URI names.

    Args:
        uri: see EXAMPLE.
        clock: name of this machine's clock, for the stamps.
        now_ns: CLOCK_MONOTONIC now, ns.

    Returns:
        The open camera.

    Raises:
        SettingsError: the URI makes no sense.
        UnavailableError: there is no such device or folder.
        DataError: a replay's images are bad.
    """
    scheme, path, options, orientation = _parts(uri)
    if scheme in _KINDS:
        settings = _read(scheme, uri, path, options, clock)
        camera: Camera = named(_KINDS[scheme].open)(settings, now_ns)
        return turned(camera, orientation)
    request = CameraRequest(uri=uri, path=path, options=tuple(options.items()), clock=clock, now_ns=now_ns)
    extension: Camera = make_registered(_CAMERAS, scheme, Camera, request)
    return turned(extension, orientation)


def parse_camera(uri: str, clock: str) -> object:
    """Parse a camera URI without opening anything.

    Args:
        uri: see EXAMPLE.
        clock: name of this machine's clock, for the stamps.

    Returns:
        The camera's settings: ReplaySettings or V4l2Settings; None for another package's camera, which parses them when it opens.

    Raises:
        SettingsError: the URI makes no sense.
    """
    scheme, path, options, _ = _parts(uri)
    return _read(scheme, uri, path, options, clock) if scheme in _KINDS else None


def parse_orientation(uri: str) -> Orientation:
    """Parse how a camera URI says that the camera is mounted.

    Args:
        uri: see EXAMPLE.

    Raises:
        SettingsError: the URI makes no sense.
    """
    return _parts(uri)[-1]


def _read(scheme: str, uri: str, path: str, options: dict[str, str], clock: str) -> object:
    settings: object = named(_KINDS[scheme].read)(uri, path, options, clock)
    return settings


def _parts(uri: str) -> tuple[str, str, dict[str, str], Orientation]:
    """Split scheme, path, options and orientation; check that the scheme is known."""
    scheme, found, rest = uri.partition(":")
    known = found and (scheme in _KINDS or scheme in registered_names(_CAMERAS))
    if not known or (scheme == "replay" and not rest):
        raise SettingsError(f"camera {uri!r} is of an unknown kind", f"give {EXAMPLE}")
    path, options = _split(uri, rest)
    others = {name: value for name, value in options.items() if name not in ORIENTING}
    return scheme, path, others, orientation_of(options, uri)


def _split(uri: str, rest: str) -> tuple[str, dict[str, str]]:
    """Split path and options. A `?` without a following `=` belongs to a glob."""
    path, mark, query = rest.rpartition("?")
    if not mark or "=" not in query:
        return rest, {}
    try:
        return path, dict(parse_qsl(query, keep_blank_values=True, strict_parsing=True))
    except ValueError:
        raise SettingsError(f"camera {uri!r} has options {query!r}", f"give {EXAMPLE}") from None
