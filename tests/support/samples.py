"""A typical camera, frame and ledger; a test says what differs: `replace(LEDGER, done_ns=5)`."""

from typing import Final

from common.camera.v4l2_controls import Control
from common.frame import Frame, PixelFormat
from common.ledger import BoardMarks, HostMarks, PairLedger, StageTimes
from common.protocol.message import CameraDescription, FrameMessage, Pacing
from common.stamp import HOST_CLOCK, Stamp

CAMERA: Final = CameraDescription(
    name="cam", width_px=640, height_px=480, pixel_format=PixelFormat.MJPEG, period_ns=33_000_000, pacing=Pacing.CLOCK
)

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


def shot(
    sequence: int,
    exposed_ns: int = 0,
    clock: str = HOST_CLOCK,
    *,
    grabbed_ns: int | None = None,
    size_px: tuple[int, int] = (1, 1),
    pixel_format: PixelFormat = PixelFormat.MJPEG,
    payload: bytes = b"",
) -> Frame:
    """A camera's frame; without `grabbed_ns` it was grabbed as soon as it was exposed."""
    return Frame(
        sequence=sequence,
        exposed=Stamp(exposed_ns, clock),
        grabbed=Stamp(exposed_ns if grabbed_ns is None else grabbed_ns, clock),
        width_px=size_px[0],
        height_px=size_px[1],
        pixel_format=pixel_format,
        exposure_ns=None,
        payload=payload,
    )


def control(
    control_id: int,
    name: str,
    kind: int,
    values: tuple[int, int, int, int],
    *,
    flags: int = 0,
    menu: tuple[tuple[int, str], ...] = (),
) -> Control:
    """A camera's control; `values`: the least, the greatest, the step between them, and the default."""
    least, greatest, step, default = values
    return Control(
        id=control_id,
        name=name,
        kind=kind,
        minimum=least,
        maximum=greatest,
        step=step,
        default=default,
        flags=flags,
        menu=menu,
    )
