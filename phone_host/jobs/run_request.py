"""What a run is asked for, and what of it can be checked before anything is opened."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError
from common.program.quantities import seconds
from common.program.request import Request, option, option_of, part
from common.program.settings import Resolved
from phone_host.declared_settings import PhoneHostSettings
from phone_host.jobs.depth import LimitedDepthOptions, depth_wanted
from phone_host.jobs.options import LAN_HELP, RunCameraOptions
from phone_host.model import Rig, Side
from phone_host.output.rig_yaml import read_rig
from phone_host.recording.playback import Playback
from phone_host.run.pair_budget import usable_matchers
from phone_host.run.recording_sinks import Computed
from phone_host.settings import check, matcher_is_given, resolve_settings
from phone_host.stereo.budget import BudgetWanted
from phone_host.stereo.core import StereoCore
from phone_host.stereo.matcher_names import matcher_named

_RIG: Final = "rig.yaml"
_MOST_SECONDS: Final = 10_000_000
"""Four months; more than that is a slip of the hand."""


def _topics(text: str, option: str) -> frozenset[Computed]:
    known = {each.value: each for each in Computed}
    names = [word.strip() for word in text.split(",")]
    if not set(names) <= known.keys():
        raise SettingsError(f"{option} {text!r}", "give depth, cloud, or depth,cloud")
    return frozenset(known[word] for word in names)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest(Request):
    """What a run can be told. `command` is the verb whose results these are."""

    command: str = "run"
    cameras: RunCameraOptions = part(RunCameraOptions, group="cameras and links")
    depth: LimitedDepthOptions = part(LimitedDepthOptions, group="depth")
    no_correction: bool = option(
        "--no-correction",
        group="calibration",
        action="store_true",
        help="only tell when the cameras have turned since the calibration; correct nothing",
    )
    board_side: Side | None = option(
        "--board-side",
        group="cameras and links",
        read=lambda text, _: Side(text),
        choices=("left", "right"),
        help="which view the board's camera gives (default: as in the calibration, else left)",
    )
    fifo: str | None = option_of(PhoneHostSettings, "fifo", group="depth")
    budget_ms: float | None = option_of(PhoneHostSettings, "budget", group="depth")
    align_phase: str | None = option_of(PhoneHostSettings, "align_phase", group="cameras and links")
    interpolate: bool | None = option_of(PhoneHostSettings, "interpolate", group="depth")
    pairs: int | None = option(
        "--pairs",
        group="output",
        type=int,
        metavar="N",
        help="end after N pairs; exit with code 4 if the stream ends before that (default 0: no limit)",
    )
    duration_s: float = option(
        "--seconds",
        number=seconds,
        default=0.0,
        metavar="S",
        help="end S seconds after the first pair; exit with code 4 if none comes within 10 seconds more (default: no limit)",
    )
    record: Path | None = option(
        "--record",
        type=Path,
        metavar="FILE.mcap",
        help="keep what both cameras give as it comes, also what finds no partner; any program for ROS 2 recordings reads it",
    )
    record_topics: frozenset[Computed] | None = option(
        "--record-topics",
        group="output",
        read=_topics,
        metavar="NAMES",
        help="with --record: also what was computed, at most once a second: depth, cloud, or depth,cloud",
    )
    replay: str | None = option(
        "--replay",
        metavar="FILE.mcap[?pace=clock]",
        help="play a recording in place of --link and --camera: every frame with the same partner each time; with pace=clock at the times of then; without --calibration the rig.yaml in it counts",
    )
    out: Path | None = option(
        "--out", type=Path, metavar="DIR", help="folder for delays.jsonl, report.json, index.html and saved pairs"
    )
    save_every: int = option(
        "--save-every",
        group="output",
        type=int,
        default=30,
        metavar="N",
        help="save every Nth pair, beginning with the first; 0 saves none (default 30)",
    )
    serve: str | bool | None = option(
        "--serve",
        page=False,
        nargs="?",
        const=True,
        metavar="HOST:PORT",
        help="show the run on a page of this machine (default 127.0.0.1:8765, with --lan 0.0.0.0:8765); phone-host serve does more",
    )
    lan: bool = option("--lan", page=False, group="output", action="store_true", help=f"with --serve: {LAN_HELP}")
    max_megapixels: int | None = option_of(PhoneHostSettings, "max_megapixels", group="cameras and links")
    config: Path | None = option(
        "--config", page=False, group="settings", type=Path, metavar="FILE", help="settings file (TOML)"
    )
    log_level: str | None = option_of(PhoneHostSettings, "log_level", group="settings")


def checked(request: RunRequest, found: Resolved[PhoneHostSettings] | None = None) -> Resolved[PhoneHostSettings]:
    """Check the settings and all numbers, as far as that can be done without opening anything.

    Args:
        request: of the run.
        found: its settings; None: they are resolved from options, environment and file.

    Raises:
        SettingsError: a setting or an option is not valid.
    """
    found = found or resolve_settings(request.given)
    check(found.values)
    _check(request)
    depth_wanted(request.depth)
    return found


def _check(request: RunRequest) -> None:
    if request.record_topics is not None and request.record is None:
        raise SettingsError("--record-topics without --record", "add --record FILE.mcap, or leave it out")
    if request.pairs is not None and request.pairs < 0:
        raise SettingsError(f"--pairs is {request.pairs}", "give 1 or more, or 0 for no limit")
    if request.save_every < 0:
        raise SettingsError(f"--save-every is {request.save_every}", "give 0 or more")
    if request.budget_ms == 0:
        raise SettingsError("--budget is 0 ms", "give the time for each pair, for example 30ms, or leave it out")
    if not 0 <= request.duration_s <= _MOST_SECONDS:
        raise SettingsError(f"--seconds is {request.duration_s:g}", f"give 0 (no limit) to {_MOST_SECONDS} seconds")


def with_own_rig(
    request: RunRequest, found: Resolved[PhoneHostSettings], playback: Playback, tell: Callable[[str], None]
) -> tuple[Resolved[PhoneHostSettings], Rig | None]:
    """Return the settings of a replay with the recording's own rig for its calibration, if there is one of use and no other is given.

    A recording without one, or with one that is damaged or was rejected, can be replayed all the same: pairs and delays only.

    Args:
        request: of the run.
        found: its settings.
        playback: the recording.
        tell: takes a line that the user should know.

    Returns:
        The settings, and the rig; None: it is not to be taken from the recording.
    """
    content = playback.recorded.attachments.get(_RIG)
    if found.values.calibration or request.depth.rectified or content is None:
        return found, None
    try:
        rig = read_rig(Path(f"{_RIG} in {playback.file}"), bytes(content))
    except DataError as error:
        tell(f"not used: {error.problem}")
        return found, None
    if rig.is_rejected and not request.depth.use_rejected_rig:
        tell(
            f"not used: {_RIG} in {playback.file} was rejected by its own calibration; --use-rejected-rig takes it all the same"
        )
        return found, None
    tell(f"no --calibration: depth is computed by {_RIG} in {playback.file}")
    origins = tuple((name, str(playback.file) if name == "calibration" else origin) for name, origin in found.origins)
    return replace(found, values=replace(found.values, calibration=_RIG), origins=origins), rig


def budget_wanted(
    request: RunRequest, resolved: Resolved[PhoneHostSettings], core: StereoCore | None
) -> BudgetWanted | None:
    """Return the time budget; None without one, or without depth.

    Args:
        request: of the run.
        resolved: the settings, checked, and their origins.
        core: the stereo core, if there is one.

    Raises:
        SettingsError: there is nothing to choose, or no depth to compute though the option asks for it.
    """
    settings = resolved.values
    if not settings.budget:
        return None
    if core is None:
        if request.budget_ms is not None:
            raise SettingsError(
                "--budget without --calibration or --rectified, so no depth is computed",
                "add one of them, or leave it out",
            )
        return None
    is_named = matcher_is_given(resolved)
    has_range = request.depth.disparities is not None or request.depth.near_m is not None
    wanted = BudgetWanted(
        budget_ns=round(settings.budget * 1e6),
        matchers=(matcher_named(settings.matcher),) if is_named else usable_matchers(),
        may_scale=request.depth.scale is None,
        may_narrow=not has_range,
    )
    if is_named and has_range and not wanted.may_scale:
        range_option = "--near" if request.depth.disparities is None else "--disparities"
        raise SettingsError(
            f"--budget beside --matcher, --scale and {range_option} has nothing left to choose", "leave one of them out"
        )
    return wanted
