"""Says that a camera went away during a run and did not come back. Pure."""

from collections.abc import Sequence
from typing import Final

from common.camera.base import CameraHealth, CameraState
from phone_host.measure.absence import Away
from phone_host.measure.trouble import Trouble
from phone_host.measure.trust import Concern, Doubt

GONE: Final = frozenset({Doubt.BOARD_GONE, Doubt.CAMERA_GONE})
"""Doubts about when depth came, not whether it is right."""


def gone_concerns(
    ended: str, away: Sequence[Away], camera: CameraHealth, last_s: float, refused: Trouble | None = None
) -> tuple[Concern, ...]:
    """Say which camera is away; empty if both are there, or their streams ended as they should.

    Args:
        ended: why the run ended, or `running`.
        away: when the board was away.
        camera: health of this machine's camera.
        last_s: when the last pair was done, counted from the start of the run, s.
        refused: why the board refuses this host now; None: it does not, or is silent.
    """
    found = []
    back = "has not come back" if ended == "running" else "did not come back"
    if away and not away[-1].is_over and ended != "stream_ended":
        gone = f"the board went away at {away[-1].at_s:.0f} s and {back}"
        found.append(
            Concern(
                Doubt.BOARD_GONE,
                f"{gone}: there is no newer depth",
                "check its power, its cable or network, and that board-agent still runs there",
            )
            if refused is None
            else Concern(Doubt.BOARD_GONE, f"{gone}, because {refused.problem}", refused.remedy)
        )
    if camera.state is CameraState.GONE:
        found.append(
            Concern(
                Doubt.CAMERA_GONE,
                f"this machine's camera went away at about {last_s:.0f} s and {back}: there is no newer depth",
                "check its power, its cable or network, and that no other program has taken it; a phone's app must stay in front",
            )
        )
    return tuple(found)
