"""Opens the recording that an option names: FILE.mcap, with options behind a question mark as a camera's address has them."""

from pathlib import Path
from urllib.parse import parse_qsl

from common.errors import SettingsError
from common.protocol.message import Pacing
from phone_host.model import Side
from phone_host.recording.playback import Playback

_PACES = {pacing.name.lower(): pacing for pacing in Pacing}


def open_playback(text: str, board_side: str | None = None) -> Playback:
    """Open a recording that is to be played.

    Args:
        text: FILE.mcap, FILE.mcap?pace=clock or FILE.mcap?pace=demand.
        board_side: left or right: which images came over the link; None: as the recording says.

    Raises:
        SettingsError: the option is none.
        DataError: it cannot be read, or is no recording of two cameras.
    """
    path, mark, query = text.partition("?")
    options = dict(parse_qsl(query, keep_blank_values=True))
    pace = options.pop("pace", "demand")
    if pace not in _PACES or options or (mark and not query):
        raise SettingsError(f"--replay {text!r} is not understood", "give FILE.mcap, or 'FILE.mcap?pace=clock'")
    return Playback(Path(path), _PACES[pace], None if board_side is None else Side(board_side))
