"""Stills and films do not mix: one shows an image on demand, the other by its clock."""

from common.camera.image_numbers import plain_camera
from common.errors import SettingsError
from common.protocol.message import CameraDescription, Pacing

_REMEDY = (
    "for photographs, leave fps=, loop=, phase_ms= and pace=clock out on both sides; for a film or a live camera, give fps="
    " or loop=1 on the side that shows stills"
)


def require_one_kind(own: CameraDescription, board: CameraDescription) -> None:
    """Refuse stills on one side beside a camera with a clock on the other: nothing says which images belong together.

    Args:
        own: this machine's camera.
        board: the board's camera.

    Raises:
        SettingsError: one of the two shows images on demand, the other by its clock.
    """
    if own.pacing is board.pacing:
        return
    names = f"the board's camera {_address(board)}", f"this machine's camera {_address(own)}"
    stills, film = names if board.pacing is Pacing.DEMAND else names[::-1]
    raise SettingsError(f"{stills} shows stills, {film} keeps a clock", _REMEDY)


def _address(camera: CameraDescription) -> str:
    """Return what a camera's address begins with, as far as its description tells."""
    kind, space, rest = plain_camera(camera.name).partition(" ")
    return f"{kind}:{rest}" if kind == "replay" and space else camera.name
