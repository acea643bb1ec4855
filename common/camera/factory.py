"""Camera URI to camera. The registry of cameras: each kind is imported when it is asked for.

Other packages' cameras are registered as entry points of the group `tandemscan.cameras`; the name is the URI's scheme, lower case. The entry
point is a callable that takes one CameraRequest, opens the camera and gives a `common.camera.base.Camera`; for an option of no use it raises
a SettingsError, for a device that cannot be had an UnavailableError.
"""

from dataclasses import dataclass
from typing import Final
from urllib.parse import parse_qsl

from common.camera.base import Camera
from common.camera.options import EXAMPLE
from common.errors import SettingsError
from common.program.extensions import make_registered, named, registered_names

_CAMERAS: Final = "tandemscan.cameras"


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraRequest:
    """A camera of another package that is to be opened.

    Attributes:
        uri: the whole of it, for errors.
        path: what stands between the scheme and the options.
        options: those behind the question mark, in their order.
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
    """Where a kind of camera is found.

    Attributes:
        read: takes URI, path, options and clock, gives the settings.
        open: takes the settings and CLOCK_MONOTONIC, ns, gives the camera.
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
    scheme, path, options = _parts(uri)
    if scheme in _KINDS:
        settings = _read(scheme, uri, path, options, clock)
        camera: Camera = named(_KINDS[scheme].open)(settings, now_ns)
        return camera
    request = CameraRequest(uri=uri, path=path, options=tuple(options.items()), clock=clock, now_ns=now_ns)
    extension: Camera = make_registered(_CAMERAS, scheme, Camera, request)
    return extension


def parse_camera(uri: str, clock: str) -> object:
    """Read a camera URI without opening anything.

    Args:
        uri: see EXAMPLE.
        clock: name of this machine's clock, for the stamps.

    Returns:
        The settings of the camera that is meant: ReplaySettings or V4l2Settings; None for another package's, which reads them when it opens.

    Raises:
        SettingsError: the URI makes no sense.
    """
    scheme, path, options = _parts(uri)
    return _read(scheme, uri, path, options, clock) if scheme in _KINDS else None


def _read(scheme: str, uri: str, path: str, options: dict[str, str], clock: str) -> object:
    settings: object = named(_KINDS[scheme].read)(uri, path, options, clock)
    return settings


def _parts(uri: str) -> tuple[str, str, dict[str, str]]:
    """Part scheme, path and options; the scheme is one that is known."""
    scheme, found, rest = uri.partition(":")
    known = found and (scheme in _KINDS or scheme in registered_names(_CAMERAS))
    if not known or (scheme == "replay" and not rest):
        raise SettingsError(f"camera {uri!r} is of no known kind", f"give {EXAMPLE}")
    return scheme, *_split(uri, rest)


def _split(uri: str, rest: str) -> tuple[str, dict[str, str]]:
    """Part path and options; a `?` without `=` behind it belongs to a glob."""
    path, mark, query = rest.rpartition("?")
    if not mark or "=" not in query:
        return rest, {}
    try:
        return path, dict(parse_qsl(query, keep_blank_values=True, strict_parsing=True))
    except ValueError:
        raise SettingsError(f"camera {uri!r} has options {query!r}", f"give {EXAMPLE}") from None
