"""Camera URI to camera."""

from fractions import Fraction
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl

from common.camera.base import Camera
from common.camera.options import exact
from common.errors import SettingsError
from common.protocol.message import Pacing

if TYPE_CHECKING:
    from common.camera.replay import ReplaySettings
    from common.camera.v4l2_stream import V4l2Settings

EXAMPLE = "v4l2:/dev/video0[?size=640x480&fps=30&format=mjpeg] or replay:PATH[?fps=30&loop=1&pace=clock|demand]"


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
    settings = parse_camera(uri, clock)
    if uri.startswith("replay:"):
        from common.camera.replay import ReplayCamera, ReplaySettings  # noqa: PLC0415 - each kind only where it is of use

        assert isinstance(settings, ReplaySettings)
        return ReplayCamera(settings, now_ns)
    from common.camera.v4l2 import V4l2Camera  # noqa: PLC0415 - ctypes and the kernel's structures
    from common.camera.v4l2_stream import V4l2Settings  # noqa: PLC0415

    assert isinstance(settings, V4l2Settings)
    return V4l2Camera(settings, now_ns)


def parse_camera(uri: str, clock: str) -> "ReplaySettings | V4l2Settings":
    """Read a camera URI without opening anything.

    Args:
        uri: see EXAMPLE.
        clock: name of this machine's clock, for the stamps.

    Returns:
        The settings of the camera that is meant.

    Raises:
        SettingsError: the URI makes no sense.
    """
    scheme, found, rest = uri.partition(":")
    if not found or scheme not in {"replay", "v4l2"} or (scheme == "replay" and not rest):
        raise SettingsError(f"camera {uri!r} is of no known kind", f"give {EXAMPLE}")
    path, options = _split(uri, rest)
    if scheme == "v4l2":
        from common.camera.v4l2_uri import v4l2_settings  # noqa: PLC0415 - as above

        return v4l2_settings(uri, path, options, clock)
    return _replay_settings(uri, path, options, clock)


def _split(uri: str, rest: str) -> tuple[str, dict[str, str]]:
    """Part path and options; a `?` without `=` behind it belongs to a glob."""
    path, mark, query = rest.rpartition("?")
    if not mark or "=" not in query:
        return rest, {}
    try:
        return path, dict(parse_qsl(query, keep_blank_values=True, strict_parsing=True))
    except ValueError:
        raise SettingsError(f"camera {uri!r} has options {query!r}", f"give {EXAMPLE}") from None


def _replay_settings(uri: str, path: str, options: dict[str, str], clock: str) -> "ReplaySettings":
    from common.camera.replay import ReplaySettings  # noqa: PLC0415 - as above

    if unknown := set(options) - {"fps", "loop", "pace", "phase_ms"}:
        raise SettingsError(f"camera {uri!r} has an unknown option {min(unknown)!r}", f"give {EXAMPLE}")
    try:
        fps = exact(options.get("fps", "30"))
        loop = {"0": False, "1": True}[options.get("loop", "0")]
        pacing = Pacing[options.get("pace", "clock").upper()]
        phase_ns = round(Fraction(options.get("phase_ms", "0")) * 1_000_000)
    except (ValueError, ZeroDivisionError, KeyError):
        raise SettingsError(f"camera {uri!r} has an option of no use", f"give {EXAMPLE}") from None
    if not Fraction(1, 100) <= fps <= 1000:
        raise SettingsError(f"camera {uri!r} has fps={options.get('fps')}", "give a rate between 0.01 and 1000")
    if phase_ns and pacing is Pacing.DEMAND:
        raise SettingsError(f"camera {uri!r} has phase_ms and pace=demand", "leave one out: demand knows no clock")
    return ReplaySettings(path=path, fps=fps, loop=loop, pacing=pacing, clock=clock, phase_ns=phase_ns)
