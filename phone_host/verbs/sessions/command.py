"""phone-host sessions: look into recordings, mend and cut them, and turn them into folders and back."""

import argparse
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError
from common.places import make_folder
from common.plain_text import printable
from common.program.terminal import fitted
from common.recording.layout import CAPTURE
from common.recording.mcap_records import Damage, Message
from common.recording.opened import is_recording, open_recorded
from common.recording.recorded import Recorded
from common.recording.recording_file import require_new
from common.recording.stamps import MAX_HZ, MIN_HZ
from common.versions import REPORT_FORMAT
from common.words import counted, listed
from phone_host.model import Side
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.recording.bags import as_recording
from phone_host.recording.copied import CopyAccount, copy_recording
from phone_host.recording.folders import export_folders, import_folders
from phone_host.recording.given_times import Unit
from phone_host.recording.joining import JoinAccount, join_recordings
from phone_host.recording.other_topics import ImportOptions, import_topics
from phone_host.recording.session_info import SessionInfo, session_info
from phone_host.recording.timed_images import TimeOptions
from phone_host.run.progress_bar import busy_bar
from phone_host.verbs.output_folders import require_alone, unwritable
from phone_host.verbs.sessions.page import info_page

_MOST_LISTED: Final = 40
Told = tuple[Mapping[str, object], str]
"""What is printed: as JSON, and as text."""


def run(options: argparse.Namespace) -> int:
    """Do one task."""
    _check(options)
    tasks: dict[str, Callable[[argparse.Namespace], Told]] = {
        "info": _info,
        "repair": _repair,
        "cut": _cut,
        "export": _export,
        "import": _import,
    }
    if options.task == "join":
        values, text = _join(options)
    else:
        with busy_bar(f"sessions {options.task}"), as_recording(options.paths[0]) as source:
            options.source, options.damages = source.path, source.damages
            values, text = tasks[options.task](options)
    if options.json:
        print(json_text({"format_version": REPORT_FORMAT, "command": "sessions", "task": options.task, **values}))
    else:
        print(fitted(text))
    return 0


def _check(options: argparse.Namespace) -> None:
    if options.task == "join" and len(options.paths) < 2:
        raise SettingsError("sessions join takes two recordings or more", "name the board's and the host's")
    if options.task not in {"join", "import"} and len(options.paths) != 1:
        raise SettingsError(f"sessions {options.task} takes one recording", "name one")
    if options.task != "info" and options.out is None:
        raise SettingsError(f"sessions {options.task} needs --out", "add --out PATH")
    if options.task not in {"info", "export"} and is_recording(options.out.name):
        require_alone(options.out.parent, options.out.name)
    if options.task not in {"info", "export"}:
        require_new(options.out, "--out")
    if options.last is not None and options.last <= options.first:
        raise SettingsError("--to is not behind --from", "give a later time, s after the first image")
    if options.task != "join" and options.clock is not None:
        raise SettingsError("--clock is for join", "leave it out")
    if options.task != "import" and (options.times is not None or options.topics is not None):
        raise SettingsError("--times and --topics are for import", "leave them out")
    if options.task != "import" and (options.fps is not None or options.stamps_in is not None):
        raise SettingsError("--fps and --stamps-in are for import", "leave them out")
    if options.fps is not None and (options.times is not None or options.stamps_in is not None):
        raise SettingsError("--fps leaves the times out that --times and --stamps-in tell of", "leave one of both out")
    if options.fps is not None and not MIN_HZ <= options.fps <= MAX_HZ:
        raise SettingsError(f"--fps is {options.fps:g}", "give 0.1 to 1000 images per second")


def _info(options: argparse.Namespace) -> Told:
    path: Path = options.paths[0]
    recorded = _recorded(options)
    info = session_info(recorded)
    page = None
    if options.out is not None:
        page = options.out / "index.html"
        try:
            make_folder(options.out)
            write_text(page, info_page(path.name, recorded, info))
        except OSError as error:
            raise unwritable(options.out, error) from error
    lines = _lines(path, info) + ([f"plots: {page}"] if page else [])
    return {**asdict(info), "page": None if page is None else str(page)}, "\n".join(lines)


def _recorded(options: argparse.Namespace) -> Recorded:
    recorded = open_recorded(options.source)
    recorded.damages += options.damages
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


def _repair(options: argparse.Namespace) -> Told:
    return _copied(options, copy_recording(options.source, options.out))


def _cut(options: argparse.Namespace) -> Told:
    path = options.paths[0]
    recorded = open_recorded(options.source)
    every = [shown for stream in recorded.images.values() for shown in stream]
    zero_ns = min(shown.image.stamp_ns for shown in every)
    first_ns = zero_ns + round(options.first * 1e9)
    last_ns = math.inf if options.last is None else zero_ns + round(options.last * 1e9)
    if not any(first_ns <= shown.log_ns < last_ns for shown in every):
        length_s = (max(shown.log_ns for shown in every) - zero_ns) / 1e9
        raise DataError(
            f"{path} holds no image of that time: it lasts {length_s:.1f} s", "give another --from and --to"
        )
    del recorded, every

    def wanted(message: Message) -> bool:
        topic = "" if message.channel is None else message.channel.topic
        return topic == CAPTURE or topic.endswith("camera_info") or first_ns <= message.log_ns < last_ns

    return _copied(options, copy_recording(options.source, options.out, wanted))


def _copied(options: argparse.Namespace, account: CopyAccount) -> Told:
    """Tell what was copied.

    Raises:
        DataError: nothing was.
    """
    damages = [*options.damages, *account.damages]
    told = _missing(damages)
    told += [
        f"left out: {count} of {topic}, a message that is not known here" for topic, count in account.left_out.items()
    ]
    if not account.images:
        options.out.unlink()
        why = f" ({'; '.join(told)})" if told else ""
        raise DataError(f"{options.paths[0]} holds no images that can be written{why}", "give a recording")
    written = f"{counted(account.messages, 'message')} written to {options.out}"
    values = {
        "file": str(options.out),
        "messages": account.messages,
        "damages": [asdict(one) for one in damages],
        "left_out": account.left_out,
    }
    return values, "\n  ".join([written, *told])


def _join(options: argparse.Namespace) -> Told:
    with busy_bar("joining"):
        account = join_recordings(options.paths, options.out, options.clock)
    values = {
        "file": str(options.out),
        "offset_ns": account.clock.offset_ns,
        "skew": account.clock.skew,
        "uncertainty_ns": account.uncertainty_ns,
        "seconds": account.seconds,
        "images": {side.value: count for side, count in account.images.items()},
        "left_out": account.left_out,
        "empty": [str(path) for path in account.empty],
    }
    return values, "\n".join(_join_lines(options.out, account))


def _join_lines(out: Path, account: JoinAccount) -> list[str]:
    images = account.images
    written = f"{images[Side.LEFT]} left and {counted(images[Side.RIGHT], 'right image')} of {account.seconds:.1f} s written to {out}"
    how = f"joined by the clock exchange that the host stored, known to +-{account.uncertainty_ns / 1e6:.2f} ms (95 %)"
    left_out = f"; {counted(account.left_out, 'image')} that only one camera has left out" if account.left_out else ""
    return [written + left_out, f"  {how}", *(f"  {path} holds no images" for path in account.empty)]


def _export(options: argparse.Namespace) -> Told:
    recorded = _recorded(options)
    counts = export_folders(recorded, options.out)
    text = f"{counts['left']} left and {counted(counts['right'], 'right image')} written to {options.out}"
    told = [*_missing(recorded.damages), *recorded.remarks]
    values = {"folder": str(options.out), "images": counts, "damages": [asdict(one) for one in recorded.damages]}
    return values, "\n  ".join([text, *told])


def _import(options: argparse.Namespace) -> Told:
    first: Path = options.paths[0]
    if len(options.paths) == 1 and (options.source.is_file() or is_recording(str(first))):
        if options.times is not None or options.stamps_in is not None:
            raise SettingsError("--times and --stamps-in are for folders of images", "leave them out")
        account = import_topics(options.source, ImportOptions(options.topics, options.fps), options.out)
    else:
        if options.topics is not None:
            raise SettingsError(f"{first} is a folder and has no topics", "leave --topics out")
        unit = None if options.stamps_in is None else Unit(options.stamps_in)
        account = import_folders(options.paths, TimeOptions(options.times, options.fps, unit), options.out)
    counts = account.images
    text = f"{counts['left']} left and {counted(counts['right'], 'right image')} written to {options.out}"
    damages = [*options.damages, *account.damages]
    told = [*_missing(damages), *account.remarks]
    lines = [text, *(printable(f"  {words}") for words in told), *_reasons(account.unused)]
    values = {
        "file": str(options.out),
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
