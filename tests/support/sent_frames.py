"""A frame as the message that a board's session makes of it."""

from common.frame import Frame
from common.ledger import BoardMarks
from common.protocol.board_session import BoardSession
from common.protocol.message import FrameMessage
from common.protocol.session import Outgoing


def frame_outgoing(board: BoardSession, frame: Frame) -> Outgoing:
    """The next frame that this board sends. It has credit; `sent` spends it.

    Args:
        board: the sender.
        frame: what it sends.
    """
    assert board.frames_lane is not None
    message = FrameMessage(
        session=board.session,
        sent_index=board.next_index,
        sequence=frame.sequence,
        width_px=frame.width_px,
        height_px=frame.height_px,
        pixel_format=frame.pixel_format,
        exposure_ns=frame.exposure_ns,
        marks=BoardMarks(exposed_ns=frame.exposed.ns, grabbed_ns=frame.grabbed.ns, sent_ns=frame.grabbed.ns),
        payload=frame.payload,
    )
    return Outgoing(board.frames_lane, message)
