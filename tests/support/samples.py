"""A typical frame and ledger; a test says what differs: `replace(LEDGER, done_ns=5)`."""

from typing import Final

from common.frame import PixelFormat
from common.ledger import BoardMarks, HostMarks, PairLedger, StageTimes
from common.protocol.message import FrameMessage

MARKS: Final = BoardMarks(exposed_ns=0, grabbed_ns=0, sent_ns=0)

FRAME: Final = FrameMessage(
    session="s",
    sent_index=0,
    sequence=0,
    width_px=1,
    height_px=1,
    pixel_format=PixelFormat.MJPEG,
    exposure_ns=None,
    marks=MARKS,
    payload=b"",
)

LEDGER: Final = PairLedger(
    session="s",
    sequence=0,
    host_sequence=0,
    bytes=9,
    link="tcp",
    board=MARKS,
    received_ns=0,
    paired_ns=0,
    queued_ns=0,
    dequeued_ns=0,
    done_ns=0,
    previous_done_ns=0,
    stages=StageTimes(),
    time_skew_ns=0,
    offset_ns=0,
    uncertainty_ns=0,
    host=HostMarks(exposed_ns=0, grabbed_ns=0),
)
