"""Time for cameras that show an image only on demand: which camera is asked when, and what the stamps then mean.

A demand-paced board shows its next image when there is room for it. A demand-paced host camera shows one image for each
board frame. So every image meets its partner, however slow the machine is. The stamps of such images are labels:
first + number x period (decision 0004). Labels may be compared with each other but not with any clock.

Only this class knows the rules. The pair queue tells it of the board's sessions and frames and asks what their stamps
mean. The host camera asks it when to show an image.
"""

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass

from common.camera.image_numbers import ImageNumbers
from common.protocol.message import Pacing
from phone_host.sync.stills import Stills


def has_own_time(pacing: Pacing) -> bool:
    """Return whether the stamps of a camera with this pacing are times rather than labels."""
    return pacing is not Pacing.DEMAND


@dataclass(frozen=True, slots=True)
class _Want:
    """An image wanted from the host camera: its board session, label (host's clock, ns), and number if that matters."""

    life: int
    label_ns: int
    number: int | None


class DemandClock:
    """The demand clock of one run.

    If neither camera is paced by demand, no image is ever asked for, and stamps are times.

    Args:
        own: the host camera's pacing.
        stills: the host camera's images; None if it is no replay. Then its images count from 0.
        is_timeless: whether the stamps are those of another day, though both cameras had a clock then.
    """

    def __init__(self, own: Pacing, stills: Stills | None = None, *, is_timeless: bool = False) -> None:
        self._stills = stills
        self.paces_own_camera = not has_own_time(own)
        """Whether the host camera shows an image only when one is wanted."""
        self.is_timeless = self.paces_own_camera or is_timeless
        """Whether stamps of this run are labels, or ever were. No clock can tell the age of a label."""
        self.labels_board = False
        """Whether the stamps of the present board session are labels."""
        self._label_offset_ns: int | None = None
        # Bounded by the credit: the board sends no frame for which the pair queue has no room.
        self._wants: queue.SimpleQueue[_Want | None] = queue.SimpleQueue()
        self._life = 0
        self._expected: int | None = None
        self._showing = threading.Lock()

    @property
    def stills(self) -> Stills | None:
        """Says which own image belongs to each board frame; None if the stamps say it."""
        return self._stills if self.labels_board and self.paces_own_camera else None

    @property
    def is_one_sided(self) -> bool:
        """Whether the board has labels but the host camera has a clock. Then no board frame can be paired."""
        return self.labels_board and not self.paces_own_camera

    def begin(self, board: Pacing, images: ImageNumbers | None = None, period_ns: int = 1) -> None:
        """Begin a board session, with new labels. No image that was asked for earlier comes after this call.

        Waits for an image that is being shown. Do not call this with a lock held that the image's delivery needs.

        Args:
            board: the board camera's pacing.
            images: what the board tells of its images; None if it tells nothing.
            period_ns: time between two of its labels.
        """
        with self._showing:
            self._life += 1
            self._expected = None
        self.labels_board = not has_own_time(board)
        if self._stills is not None:
            self._stills.begin(images, period_ns)
        self.is_timeless |= self.labels_board
        self._label_offset_ns = None

    def stamp_ns(self, exposed_ns: int, offset_ns: int) -> int:
        """Return the stamp by which a board frame is paired.

        All labels use the clock offset of the first one, from which the host camera's labels continue. A better
        estimate could move later labels by more than a fast film's period.

        Args:
            exposed_ns: exposure on the host's clock, computed with the frame's own offset, ns.
            offset_ns: that offset, host's clock minus board's clock, ns.
        """
        if not self.labels_board:
            return exposed_ns
        if self._label_offset_ns is None:
            self._label_offset_ns = offset_ns
        return exposed_ns + self._label_offset_ns - offset_ns

    def frame_came(self, stamp_ns: int, number: int) -> None:
        """Ask the host camera for the partner of a board frame, without waiting for it.

        Args:
            stamp_ns: the stamp by which that frame is paired.
            number: which image of the host camera, from 0, if both cameras have labels: as `stills` says, else the
                frame's number in the board session. If the board has a clock, the host camera shows its images in
                order, with labels that start at the first frame's stamp.
        """
        if self.paces_own_camera:
            self._wants.put(_Want(self._life, stamp_ns, number if self.labels_board else None))

    def show_next(self, anchor: Callable[[int, int], None], show: Callable[[], None]) -> None:
        """Wait until an image is wanted, then show it.

        `wake`, or a want of an earlier session, ends the wait and nothing is shown.

        Args:
            anchor: called with a label and a number if the wanted image does not follow the last one shown.
            show: reads the camera once and delivers its frames.
        """
        want = self._wants.get()
        with self._showing:
            if want is None or want.life != self._life:
                return
            if self._expected is None or want.number not in {None, self._expected}:
                anchor(want.label_ns, want.number or 0)
            self._expected = 0 if want.number is None else want.number + 1
            show()

    def wake(self) -> None:
        """Let `show_next` return. Safe from any thread."""
        self._wants.put(None)
