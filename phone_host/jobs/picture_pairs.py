"""Pictures as a command names them: files, folders or globs of both sides, or a recording, out of which the stillest are chosen; and how their pairs are matched."""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path, PurePath
from typing import Final

from common.errors import SettingsError
from common.places import resolved
from common.recording.opened import is_recording
from phone_host.jobs.depth import DepthOptions
from phone_host.jobs.options import ImageOptions
from phone_host.jobs.output_folders import announce_other_report, require_alone, require_writable, spare_inputs, writing
from phone_host.jobs.stereo_core import core_for_files, require_cameras
from phone_host.model import Side
from phone_host.recording.chosen_views import choose_views
from phone_host.run.file_pairs import FilePairs, Matching
from phone_host.run.progress_bar import StepBar, share_bar, step_bar, tell
from phone_host.settings import most_pixels
from phone_host.stereo.default_matcher import default_matcher, default_note
from phone_host.stereo.view_files import pair_files

VIEWS: Final = "views"
"""The folder beside the results for pictures that a command takes or chooses itself."""


@dataclass(frozen=True, slots=True)
class GivenPictures:
    """Pictures of both sides, as `pair_files` takes them.

    Attributes:
        left: files, folders or globs.
        right: the same.
        board_side: which of them the board's camera took; None: not told.
    """

    left: tuple[str, ...]
    right: tuple[str, ...]
    board_side: Side | None = None


def given_pictures(words: Sequence[str], place: Path, most_pixels: int) -> GivenPictures:
    """Return what a command's positional arguments name.

    Args:
        words: the arguments: those of `two_lists`, or a recording.
        place: folder for the pictures of a recording: its `views/left` and `views/right`.
        most_pixels: images of a recording that claim more are passed over.

    Raises:
        SettingsError: there is one side only, or something beside a recording.
        UnavailableError: the folders cannot be had.
        DataError: the recording cannot be read, or is no recording of two cameras.
    """
    recordings = [word for word in words if is_recording(word)]
    if not recordings:
        return GivenPictures(*two_lists(words))
    if len(words) > 1:
        raise SettingsError(f"{recordings[0]} holds both sides", "give one recording, and nothing beside it")
    folder = place / VIEWS
    with writing(folder), share_bar("reading the recording", then="looking for still pictures") as advance:
        chosen = choose_views(Path(words[0]), folder, most_pixels, advance)
    return GivenPictures((str(chosen.left),), (str(chosen.right),), chosen.board_side)


_QUOTE: Final = "put quotes around each glob, such as 'left*.png' 'right*.png'"
_SHOWN: Final = 3


def two_lists(paths: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Divide a command's positional arguments into those of the left and those of the right side.

    Two arguments are a side each. More come from globs that the shell expanded. They belong together by folder, else by
    name without its digits (left1 left2 right1 right2); else the first half is the left side, if the names are in order
    in each half but not across them, as a shell leaves two globs.

    Args:
        paths: the arguments, in the order given: files, folders or globs.

    Returns:
        Left, right; neither is empty.

    Raises:
        SettingsError: there are fewer than two, or they do not fall into two groups.
    """
    if len(paths) < 2:
        raise SettingsError(
            f"only one side is given{f' ({paths[0]})' if paths else ''}", "give LEFT and RIGHT: files, folders or globs"
        )
    if len(paths) == 2:
        return (paths[0],), (paths[1],)
    for key in (_folder, _without_digits):
        groups = _grouped(paths, key)
        if len(groups) == 2:
            return groups[0], groups[1]
    half = len(paths) // 2
    descents = [index for index in range(1, len(paths)) if paths[index].casefold() < paths[index - 1].casefold()]
    if len(paths) == 2 * half and descents == [half]:
        return tuple(paths[:half]), tuple(paths[half:])
    shown = " ".join(paths[:_SHOWN])
    raise SettingsError(
        f"{len(paths)} images are given ({shown} ...), and it is not clear which of them are LEFT and which RIGHT",
        _QUOTE,
    )


def _folder(path: str) -> str:
    return str(PurePath(path).parent)


def _without_digits(path: str) -> str:
    return re.sub(r"[0-9]+", "#", path)


def _grouped(paths: Sequence[str], key: Callable[[str], str]) -> list[tuple[str, ...]]:
    """Group neighbours that have the same key; what a shell makes of one glob stands together."""
    return [tuple(group) for _, group in groupby(paths, key)]


def matching_of(depth: DepthOptions, pictures: ImageOptions, image: Path) -> Matching:
    """Return how the pair is matched that a verb measures; its core gives metres.

    Args:
        depth: the options about depth.
        pictures: how the images are read.
        image: the left one.
    """
    matcher = depth.matcher or default_matcher().value
    return Matching(
        make_core=lambda size_px: core_for_files(depth, matcher, size_px, image),
        most_pixels=most_pixels(None, pictures.max_megapixels),
        mounted=pictures.mounted,
    )


def file_pairs(
    images: Sequence[str], out: Path, depth: DepthOptions, pictures: ImageOptions, *, needs_metres: bool = True
) -> FilePairs:
    """Pair the files that a verb names.

    Args:
        images: as `given_pictures` takes them.
        out: the results folder.
        depth: the options about depth.
        pictures: how the images are read.
        needs_metres: whether depth must be in metres.

    Raises:
        SettingsError: there is one side only, or too little is said of the cameras.
        UnavailableError: the folders for a recording's pictures cannot be had.
        DataError: there are no pairs.
    """
    require_cameras(depth, needs_metres=needs_metres)
    matcher, limit = depth.matcher or default_matcher().value, most_pixels(None, pictures.max_megapixels)
    given = given_pictures(images, out, limit)
    files = pair_files(given.left, given.right)
    image = files.pairs[0][1]
    return FilePairs(
        files=files,
        out=out,
        make_core=lambda size_px: core_for_files(depth, matcher, size_px, image, needs_metres=needs_metres),
        matcher=matcher,
        matcher_note="" if depth.matcher else default_note(),
        most_pixels=limit,
        mounted=pictures.mounted,
        tell=tell,
    )


def require_place(pairs: FilePairs, names: str, command: str) -> None:
    """Refuse a results folder that cannot be written to, holds the photographs or would lose them; keep other programs out of it.

    Args:
        pairs: the photographs, and the folder.
        names: pattern of the names in it that are replaced.
        command: the verb.

    Raises:
        SettingsError: the photographs lie in it.
        UnavailableError: it cannot be written to, or another program writes there.
    """
    out, files = pairs.out, pairs.files
    require_writable(out)
    folders = {resolved(path).parent for _, left, right in files.pairs for path in (left, right)}
    if resolved(out) in folders:
        raise SettingsError(
            f"--out {out} is the folder of the images, where later runs would take pictures of depth for photographs",
            f"give a folder of its own, such as --out {out / 'scan'}",
        )
    for _, left, right in files.pairs:
        spare_inputs(out, names, {"LEFT": left, "RIGHT": right})
    require_alone(out)
    announce_other_report(out, command, tell)


@contextmanager
def reading(pairs: FilePairs) -> Iterator[StepBar]:
    """Show a bar for the pairs while a block computes and writes them.

    Raises:
        UnavailableError: the results cannot be written.
    """
    count = len(pairs.files.pairs)
    with writing(pairs.out), step_bar("reading", count if count > 1 else None) as watcher:
        yield watcher
