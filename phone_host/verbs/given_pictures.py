"""The pictures that a command names: files, folders or globs of both sides; or a recording, out of which the stillest are chosen."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import SettingsError
from common.recording.opened import is_recording
from phone_host.jobs.output_folders import writing
from phone_host.model import Side
from phone_host.recording.chosen_views import choose_views
from phone_host.run.progress_bar import share_bar
from phone_host.verbs.globs import two_lists

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
