"""What the log says of a board: found, its camera stepped, refused."""

import logging

from common.program.logs import event
from common.protocol.message import BoardHello, Rung
from phone_host.stream.refusals import BoardRefusal, refusal_text

_LOG = logging.getLogger(__name__)


def tell_found(hello: BoardHello, link: str, *, resumed: bool) -> None:
    """Say which board was found.

    Args:
        hello: its description of itself.
        link: name of the link that it was found on.
        resumed: whether its session goes on.
    """
    camera = hello.camera
    size = f"{camera.width_px}x{camera.height_px}"
    _LOG.info(event("board_found", session=hello.session, resumed=resumed, link=link, camera=camera.name, size=size))


def tell_stepped(rung: Rung) -> None:
    """Say at what rate and quality the board's camera runs from now on."""
    fps = round(1e9 / rung.period_ns, 2)
    _LOG.info(event("board_camera_stepped", rung=rung.index, last=rung.last, fps=fps, quality=rung.quality))


def tell_refused(link: str, refusal: BoardRefusal) -> None:
    """Say why a board refuses this host, and what to do.

    Args:
        link: name of the link that it refuses on.
        refusal: its reason.
    """
    problem, remedy = refusal_text(refusal)
    _LOG.warning(event("link_refused", link=link, problem=problem, remedy=remedy))
