"""Opens a run for a program: makes a request of the arguments of `open_scanner`."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from common.errors import SettingsError
from common.program.settings import DEFAULT, Resolved
from phone_host.api.scanner import Scanner
from phone_host.camera.uris import without_password
from phone_host.declared_settings import NEAR_M, PhoneHostSettings
from phone_host.jobs.options import RunCameraOptions
from phone_host.jobs.run import open_run
from phone_host.jobs.run_request import RunRequest, checked
from phone_host.model import Rig, Side, StereoGeometry
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.stereo.core import StereoCore
from phone_host.stereo.default_matcher import default_matcher
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import matcher_named
from phone_host.stereo.matcher_protocol import Matcher
from phone_host.stereo.rectifier import Rectifier

_ORIGIN: Final = "open_scanner"
"""Where a setting comes from, for settings.json."""


def open_scanner(
    *,
    link: str | Sequence[str],
    camera: str,
    rig: str | Path | Rig | None = None,
    geometry: StereoGeometry | None = None,
    matcher: str | Matcher | None = None,
    disparities: int | None = None,
    near_m: float = NEAR_M,
    board_side: str | None = None,
    fifo: str = "1:drop-oldest",
    tolerance_ms: float | None = None,
    pairs: int = 0,
    wait_s: float | None = None,
    lossless: bool = False,
    out: str | Path | None = None,
    save_every: int = 0,
    keys: str | Path | None = None,
) -> Scanner:
    """Open both cameras. The scan begins when the scanner is entered with `with`.

    Args:
        link: address of the board (`tcp://HOST:5555`, `serial:DEVICE` …), or several. The best link that is up is used.
        camera: the host camera (`v4l2:/dev/video0?size=640x480`, `http://…/video`, `replay:FOLDER` …).
        rig: a rig, or the path of a rig.yaml. None: if `disparities` is given, the images are taken as rectified;
            otherwise no depth is computed, only pairs and delays.
        geometry: geometry of images that arrive rectified. None: disparities are not converted to metres.
        matcher: name of a matcher, or any object with `match(pair) -> disparity` (`phone_host.stereo.matcher_protocol.Matcher`).
            None: the default of this machine.
        disparities: the matcher searches 0 <= d < disparities, px. None with a rig: computed from `near_m`.
        near_m: nearest depth to search for, m.
        board_side: which view the board's camera is, `left` or `right`. None: as in the rig; without a rig, left.
        fifo: depth and overflow policy of the queue before the matcher.
        tolerance_ms: greatest time skew of a pair, ms. None or 0: half of the longer frame period.
        pairs: end after this many pairs. 0: no limit.
        wait_s: how long to wait for an absent board, s. None: for ever.
        lossless: give every result, and wait if the program is slower than the cameras.
        out: folder for the results, as `phone-host run` writes it. None: nothing is written.
        save_every: save every Nth pair in `out`. 0: none.
        keys: folder of keys. None: the default folder.

    Returns:
        The scanner.

    Raises:
        SettingsError: the arguments are invalid or contradict each other.
        DataError: rig.yaml is invalid.
        UnavailableError: a camera, link or folder cannot be opened.
    """
    given = dict(locals())
    _check_numbers(pairs=pairs, save_every=save_every, tolerance_ms=tolerance_ms, wait_s=wait_s, near_m=near_m)
    links = (link,) if isinstance(link, str) else tuple(link)
    if not links:
        raise SettingsError("no link is given", "give link='tcp://HOST:5555', or several")
    known = read_own_rig(Path(rig)) if isinstance(rig, str | Path) else rig
    if known is not None and geometry is not None:
        raise SettingsError("rig and geometry are both given", "leave geometry out: the rig has its own")
    request = RunRequest(
        cameras=RunCameraOptions(wait_s=wait_s),
        board_side=_side(board_side, known),
        pairs=pairs,
        out=None if out is None else Path(out),
        save_every=save_every,
    )
    values = PhoneHostSettings(
        link=links,
        camera=camera,
        matcher=matcher if isinstance(matcher, str) else default_matcher().value,
        tolerance=tolerance_ms or 0.0,
        fifo=fifo,
        keys="" if keys is None else str(keys),
    )
    found = checked(request, Resolved(values, (("matcher", DEFAULT if matcher is None else _ORIGIN),)))
    core = _core(known, geometry, matcher, disparities, near_m)
    return Scanner(open_run(request, found, lambda _: None, core=core), _shown(given), lossless=lossless)


def _check_numbers(**numbers: float | None) -> None:
    """Reject invalid numbers.

    Raises:
        SettingsError: a number is below 0 or not finite, or `near_m` is 0.
    """
    for name, value in numbers.items():
        if value is not None and not (math.isfinite(value) and value >= 0 and (value > 0 or name != "near_m")):
            raise SettingsError(
                f"{name} is {value:g}", "give a number above 0" if name == "near_m" else "give 0 or more"
            )


def _shown(arguments: Mapping[str, object]) -> dict[str, object]:
    """Return the arguments as settings.json stores them. An object is stored as its type name."""
    plain = (str, int, float, bool, type(None))
    told = {name: str(value) if isinstance(value, Path) else value for name, value in arguments.items()}
    told["camera"] = without_password(str(told["camera"]))
    told["link"] = told["link"] if isinstance(told["link"], str) else " ".join(str(item) for item in arguments["link"])  # type: ignore[attr-defined]  # texts, as annotated
    return {
        name: {"value": value if isinstance(value, plain) else type(value).__name__, "origin": _ORIGIN}
        for name, value in told.items()
    }


def _side(asked: str | None, rig: Rig | None) -> Side:
    if asked not in {None, *(side.value for side in Side)}:
        raise SettingsError(f"board_side is {asked!r}", "give 'left' or 'right'")
    if rig is not None and asked not in {None, rig.board_side.value}:
        raise SettingsError(
            f"board_side {asked!r} contradicts the rig", "leave it out, or calibrate with the board there"
        )
    if asked is not None:
        return Side(asked)
    return Side.LEFT if rig is None else rig.board_side


def _core(
    rig: Rig | None,
    geometry: StereoGeometry | None,
    matcher: str | Matcher | None,
    disparities: int | None,
    near_m: float,
) -> StereoCore | None:
    if rig is None and geometry is None and disparities is None and (matcher is None or isinstance(matcher, str)):
        return None
    rectifier = None if rig is None else Rectifier(rig)
    wanted = DepthWanted(search_from_m=near_m if disparities is None else math.nan)
    return StereoCore(_matcher(matcher, disparities, rectifier), rectifier, geometry, wanted)


def _matcher(
    matcher: str | Matcher | None, disparities: int | None, rectifier: Rectifier | None
) -> Matcher | MatchSettings:
    if not (matcher is None or isinstance(matcher, str)):
        return matcher
    chosen = default_matcher() if matcher is None else matcher_named(matcher)
    if disparities is not None:
        return MatchSettings(chosen, disparities)
    if rectifier is None:
        raise SettingsError("rectified images without disparities", "give the number of disparities, for example 64")
    return MatchSettings(chosen)
