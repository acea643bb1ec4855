"""phone-host sessions: look into recordings, mend and cut them, and turn them into folders and back."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError
from common.places import make_folder
from common.plain_text import printable
from common.program.quantities import frames_per_second, seconds
from common.program.request import Request, option
from common.program.terminal import fitted
from common.recording.layout import CAPTURE
from common.recording.mcap_records import Damage, Message
from common.recording.opened import is_recording, open_recorded
from common.recording.recorded import Recorded
from common.recording.recording_file import require_new
from common.recording.stamps import MAX_HZ, MIN_HZ
from common.versions import REPORT_FORMAT
from common.words import counted, listed
from phone_host.jobs.output_folders import require_alone, unwritable
from phone_host.model import Side
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.recording.bags import RecordingSource, as_recording
from phone_host.recording.import_rules import Unit
from phone_host.recording.imports import ImportOptions, export_folders, import_folders, import_topics
from phone_host.recording.joining import CopyAccount, JoinAccount, copy_recording, join_recordings
from phone_host.recording.session_info import SessionInfo, session_info
from phone_host.recording.timed_images import TimeOptions
from phone_host.run.progress_bar import busy_bar
from phone_host.verbs.sessions_page import info_page

EXAMPLES = """  phone-host sessions info session.mcap --out info    # what is inside, gaps, rates; info/index.html shows plots
  phone-host sessions repair broken.mcap --out whole.mcap
  phone-host sessions cut session.mcap --from 10 --to 25 --out part.mcap
  phone-host sessions join board.mcap host.mcap --out joined.mcap    # what a board and a host recorded, each alone
  phone-host sessions join drive-0000*.mcap host.mcap --clock earlier.mcap --out joined.mcap
  phone-host sessions export session.mcap --out folder    # left/, right/, times in ns; as EuRoC and TUM have them
  phone-host sessions import kitti/sequences/00 --out kitti.mcap
  phone-host sessions import MH_01_easy/mav0 --out euroc.mcap
  phone-host sessions import left right --times times.txt --out two.mcap
  phone-host sessions import left right --fps 30 --out two.mcap    # nothing tells their times
  phone-host sessions import bag.mcap --topics /cam0/image_raw /cam1/image_raw --out two.mcap
  phone-host sessions import rosbag2_2026_11_28 --out two.mcap    # also a .bag of ROS 1
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionsRequest(Request):
    """What sessions can be told."""

    task: str = option(choices=("info", "repair", "cut", "join", "export", "import"), help="what to do")
    paths: tuple[Path, ...] = option(
        type=Path,
        nargs="+",
        metavar="FILE.mcap",
        help="the recording; for join, the host's and the board's or all parts of it; for import, a folder or file of another program, or two folders",
    )
    out: Path | None = option(
        "--out", type=Path, metavar="PATH", help="the new recording; for export and info, a folder"
    )
    from_s: float = option(
        "--from",
        number=seconds,
        default=0.0,
        metavar="S",
        help="cut: begin S seconds after the first image (default 0)",
    )
    to_s: float | None = option(
        "--to", number=seconds, metavar="S", help="cut: end S seconds after the first image (default: with the last)"
    )
    clock: Path | None = option(
        "--clock",
        type=Path,
        metavar="FILE.mcap",
        help="join: another recording of the same host, made over the link since both machines were switched on (default: the host's own)",
    )
    times: Path | None = option(
        "--times", type=Path, metavar="FILE", help="import: the times of the images, one a line"
    )
    stamps_in: Unit | None = option(
        "--stamps-in",
        read=lambda text, _: Unit(text),
        choices=("s", "ms", "us", "ns"),
        help="import: the unit of the times in names, tables and --times (default: the one that is plausible)",
    )
    fps: float | None = option(
        "--fps",
        number=frames_per_second,
        metavar="N",
        help="import: the images came at N a second, whatever else tells their times",
    )
    topics: tuple[str, ...] | None = option(
        "--topics",
        nargs=2,
        metavar="TOPIC",
        help="import: the topics of the left and of the right images (default: the first two)",
    )


_MOST_LISTED: Final = 40
Told = tuple[Mapping[str, object], str]
"""What is printed: as JSON, and as text."""


def run(request: SessionsRequest) -> int:
    """Do one task."""
    out = _checked(request)
    if request.task == "join":
        values, text = _join(request, out)
    else:
        with busy_bar(f"sessions {request.task}"), as_recording(request.paths[0]) as source:
            values, text = _TASKS[request.task](request, source, out)
    if request.as_json:
        print(json_text({"format_version": REPORT_FORMAT, "command": "sessions", "task": request.task, **values}))
    else:
        print(fitted(text))
    return 0


def _checked(request: SessionsRequest) -> Path:
    """Check what goes together; return where the result goes."""
    if request.task == "join" and len(request.paths) < 2:
        raise SettingsError("sessions join takes two recordings or more", "name the board's and the host's")
    if request.task not in {"join", "import"} and len(request.paths) != 1:
        raise SettingsError(f"sessions {request.task} takes one recording", "name one")
    out = request.out or Path()
    if request.task != "info" and request.out is None:
        raise SettingsError(f"sessions {request.task} needs --out", "add --out PATH")
    if request.task not in {"info", "export"} and is_recording(out.name):
        require_alone(out.parent, out.name)
    if request.task not in {"info", "export"}:
        require_new(out, "--out")
    if request.to_s is not None and request.to_s <= request.from_s:
        raise SettingsError("--to is not behind --from", "give a later time, s after the first image")
    if request.task != "join" and request.clock is not None:
        raise SettingsError("--clock is for join", "leave it out")
    if request.task != "import" and (request.times is not None or request.topics is not None):
        raise SettingsError("--times and --topics are for import", "leave them out")
    if request.task != "import" and (request.fps is not None or request.stamps_in is not None):
        raise SettingsError("--fps and --stamps-in are for import", "leave them out")
    if request.fps is not None and (request.times is not None or request.stamps_in is not None):
        raise SettingsError("--fps leaves the times out that --times and --stamps-in tell of", "leave one of both out")
    if request.fps is not None and not MIN_HZ <= request.fps <= MAX_HZ:
        raise SettingsError(f"--fps is {request.fps:g}", "give 0.1 to 1000 images per second")
    return out


def _info(request: SessionsRequest, source: RecordingSource, out: Path) -> Told:
    path: Path = request.paths[0]
    recorded = _recorded(source)
    info = session_info(recorded)
    page = None
    if request.out is not None:
        page = out / "index.html"
        try:
            make_folder(out)
            write_text(page, info_page(path.name, recorded, info))
        except OSError as error:
            raise unwritable(out, error) from error
    lines = _lines(path, info) + ([f"plots: {page}"] if page else [])
    return {**asdict(info), "page": None if page is None else str(page)}, "\n".join(lines)


def _recorded(source: RecordingSource) -> Recorded:
    recorded = open_recorded(source.path)
    recorded.damages += source.damages
    return recorded


def _lines(path: Path, info: SessionInfo) -> list[str]:
    lines = [f"{path}: {info.seconds:.1f} s, {info.size_bytes / 1e6:.1f} MB"]
    for one in info.streams:
        missing = sum(gap.missing for gap in one.gaps)
        gaps = (
            f", {missing} missing in {counted(len(one.gaps), 'gap')}, the longest {one.gaps[0].seconds:.2f} s"
            if one.gaps
            else ""
        )
        size = f"{one.size_px[0]}x{one.size_px[1]}"
        lines.append(
            f"  {printable(one.topic)}: {counted(one.images, 'image')} {size}, {one.rate_hz:.2f} /s{gaps} ({one.camera})"
        )
    if info.skew is not None:
        lines.append(
            f"  time skew of the two cameras: {info.skew.median_ms:+.2f} ms, 95 % below {info.skew.far_ms:.2f} ms"
        )
    told = {*(one.topic for one in info.streams), *info.unused}
    others = [f"{topic} {count}" for topic, count in info.messages if topic not in told]
    also = listed([*others, *(name for name, _ in info.attachments)], _MOST_LISTED)
    lines.append(printable(f"  also: {also or 'nothing'}"))
    lines += _reasons(info.unused)
    lines += [printable(f"  {words}") for words in info.remarks]
    lines += [printable(f"  missing: {words}") for words in info.damages]
    if not info.is_complete or info.damages:
        lines.append(
            f"  it was not ended in order; phone-host sessions repair {path} --out whole.mcap writes a whole file"
        )
    return lines


def _repair(request: SessionsRequest, source: RecordingSource, out: Path) -> Told:
    return _copied(request.paths[0], source, out, copy_recording(source.path, out))


def _cut(request: SessionsRequest, source: RecordingSource, out: Path) -> Told:
    path = request.paths[0]
    recorded = open_recorded(source.path)
    every = [shown for stream in recorded.images.values() for shown in stream]
    zero_ns = min(shown.image.stamp_ns for shown in every)
    first_ns = zero_ns + round(request.from_s * 1e9)
    last_ns = math.inf if request.to_s is None else zero_ns + round(request.to_s * 1e9)
    if not any(first_ns <= shown.log_ns < last_ns for shown in every):
        length_s = (max(shown.log_ns for shown in every) - zero_ns) / 1e9
        raise DataError(
            f"{path} holds no image of that time: it lasts {length_s:.1f} s", "give another --from and --to"
        )
    del recorded, every

    def wanted(message: Message) -> bool:
        topic = "" if message.channel is None else message.channel.topic
        return topic == CAPTURE or topic.endswith("camera_info") or first_ns <= message.log_ns < last_ns

    return _copied(request.paths[0], source, out, copy_recording(source.path, out, wanted))


def _copied(path: Path, source: RecordingSource, out: Path, account: CopyAccount) -> Told:
    """Tell what was copied.

    Raises:
        DataError: nothing was.
    """
    damages = [*source.damages, *account.damages]
    told = _missing(damages)
    told += [
        f"left out: {count} of {topic}, a message that is not known here" for topic, count in account.left_out.items()
    ]
    if not account.images:
        out.unlink()
        why = f" ({'; '.join(told)})" if told else ""
        raise DataError(f"{path} holds no images that can be written{why}", "give a recording")
    written = f"{counted(account.messages, 'message')} written to {out}"
    values = {
        "file": str(out),
        "messages": account.messages,
        "damages": [asdict(one) for one in damages],
        "left_out": account.left_out,
    }
    return values, "\n  ".join([written, *told])


def _join(request: SessionsRequest, out: Path) -> Told:
    with busy_bar("joining"):
        account = join_recordings(request.paths, out, request.clock)
    values = {
        "file": str(out),
        "offset_ns": account.clock.offset_ns,
        "skew": account.clock.skew,
        "uncertainty_ns": account.uncertainty_ns,
        "seconds": account.seconds,
        "images": {side.value: count for side, count in account.images.items()},
        "left_out": account.left_out,
        "empty": [str(path) for path in account.empty],
    }
    return values, "\n".join(_join_lines(out, account))


def _join_lines(out: Path, account: JoinAccount) -> list[str]:
    images = account.images
    written = f"{images[Side.LEFT]} left and {counted(images[Side.RIGHT], 'right image')} of {account.seconds:.1f} s written to {out}"
    how = f"joined by the clock exchange that the host stored, known to +-{account.uncertainty_ns / 1e6:.2f} ms (95 %)"
    left_out = f"; {counted(account.left_out, 'image')} that only one camera has left out" if account.left_out else ""
    return [written + left_out, f"  {how}", *(f"  {path} holds no images" for path in account.empty)]


def _export(_: SessionsRequest, source: RecordingSource, out: Path) -> Told:
    recorded = _recorded(source)
    counts = export_folders(recorded, out)
    text = f"{counts['left']} left and {counted(counts['right'], 'right image')} written to {out}"
    told = [*_missing(recorded.damages), *recorded.remarks]
    values = {"folder": str(out), "images": counts, "damages": [asdict(one) for one in recorded.damages]}
    return values, "\n  ".join([text, *told])


def _import(request: SessionsRequest, source: RecordingSource, out: Path) -> Told:
    first: Path = request.paths[0]
    if len(request.paths) == 1 and (source.path.is_file() or is_recording(str(first))):
        if request.times is not None or request.stamps_in is not None:
            raise SettingsError("--times and --stamps-in are for folders of images", "leave them out")
        account = import_topics(source.path, ImportOptions(request.topics, request.fps), out)
    else:
        if request.topics is not None:
            raise SettingsError(f"{first} is a folder and has no topics", "leave --topics out")
        account = import_folders(request.paths, TimeOptions(request.times, request.fps, request.stamps_in), out)
    counts = account.images
    text = f"{counts['left']} left and {counted(counts['right'], 'right image')} written to {out}"
    damages = [*source.damages, *account.damages]
    told = [*_missing(damages), *account.remarks]
    lines = [text, *(printable(f"  {words}") for words in told), *_reasons(account.unused)]
    values = {
        "file": str(out),
        "images": counts,
        "remarks": account.remarks,
        "damages": [asdict(one) for one in damages],
        "unused": account.unused,
    }
    return values, "\n".join(lines)


def _missing(damages: Sequence[Damage]) -> list[str]:
    """Return a line for each place where something is missing."""
    return [printable(f"missing: {one.text}") for one in damages]


def _reasons(unused: Mapping[str, str]) -> list[str]:
    """Return a line for each topic that is not used, but not more than can be read."""
    lines = [printable(f"  not used: {topic} ({reason})") for topic, reason in list(unused.items())[:_MOST_LISTED]]
    more = len(unused) - _MOST_LISTED
    return [*lines, f"  not used: {counted(more, 'more topic')}"] if more > 0 else lines


_TASKS: Final[dict[str, Callable[[SessionsRequest, RecordingSource, Path], Told]]] = {
    "info": _info,
    "repair": _repair,
    "cut": _cut,
    "export": _export,
    "import": _import,
}
