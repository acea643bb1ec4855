"""Results of a run, without a run."""

from dataclasses import replace

import numpy as np

from common.frame import PixelFormat
from common.ledger import BoardMarks, HostMarks, StageTimes
from phone_host.model import BoardFrame, FramePair, Processed, RectifiedPair, Result
from tests.support.samples import FRAME, LEDGER, shot


def result(number: int) -> Result:
    """A result with two grey images."""
    marks = BoardMarks(exposed_ns=number, grabbed_ns=number + 1, sent_ns=number + 2)
    message = replace(
        FRAME,
        sent_index=number,
        sequence=number,
        width_px=4,
        height_px=3,
        pixel_format=PixelFormat.GREY,
        marks=marks,
        payload=b"\0" * 12,
    )
    board = BoardFrame(message=message, link="ipc", marks=marks, received_ns=number + 3, offset_ns=0, uncertainty_ns=0)
    host = shot(number, number, grabbed_ns=number + 1, size_px=(4, 3), pixel_format=PixelFormat.GREY)
    image = np.full((3, 4), number % 256, np.uint8)
    ledger = replace(
        LEDGER,
        sequence=number,
        host_sequence=number,
        board=marks,
        received_ns=number + 3,
        paired_ns=number + 4,
        queued_ns=number + 5,
        dequeued_ns=number + 6,
        done_ns=number + 7,
        host=HostMarks(exposed_ns=number, grabbed_ns=number + 1),
    )
    pair = FramePair(board=board, host=host, time_skew_ns=0, paired_ns=number + 4, queued_ns=number + 5)
    processed = Processed(RectifiedPair(image, image), np.full((3, 4), np.nan, np.float32), None, StageTimes())
    return Result(number, pair, processed, ledger)
