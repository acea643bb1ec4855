"""Time where a camera shows an image only when it is asked for one (pacing by demand): who is asked when, and what stamps mean then.

A demand-paced board shows its next image when there is room for it; a demand-paced own camera shows one for each frame of the board. So every
image meets its partner however slow the machine is. The stamps of such images are labels: first + number x period (decision 0004), which may
be compared with each other and with nothing that a clock says.

This class alone knows the rules. The pair queue tells it of the board's lives and frames and asks it what their stamps mean; the own camera
lets it say when to show an image.
"""

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass

from common.protocol.message import Pacing


def has_own_time(pacing: Pacing) -> bool:
    """Whether the stamps of a camera that is paced so are times, no labels."""
    return pacing is not Pacing.DEMAND


@dataclass(frozen=True, slots=True)
class _Want:
    """An image that is wanted of the own camera: in which life of the board, its label (host's clock, ns), and its number if it must be that one."""

    life: int
    label_ns: int
    number: int | None


class DemandClock:
    """The time of one run.

    Where neither camera is paced by demand nothing is ever asked for, and stamps mean what they say.

    Args:
        own: how the own camera is paced.
    """

    def __init__(self, own: Pacing) -> None:
        self.paces_own_camera = not has_own_time(own)
        """Whether the own camera shows an image only when one is wanted."""
        self.is_timeless = self.paces_own_camera
        """Whether stamps of this run are labels, or were since it began: how long ago one was, no clock can say."""
        self.labels_board = False
        """Whether the stamps of the board's present life are labels."""
        self._label_offset_ns: int | None = None
        # Bounded by the credit: the board sends no frame for which the pair queue has no room.
        self._wants: queue.SimpleQueue[_Want | None] = queue.SimpleQueue()
        self._life = 0
        self._expected: int | None = None
        self._showing = threading.Lock()

    @property
    def is_one_sided(self) -> bool:
        """Whether the board's labels stand beside an own camera with a clock: then nothing of the board can be paired."""
        return self.labels_board and not self.paces_own_camera

    def begin(self, board: Pacing) -> None:
        """Another life of the board begins, whose labels begin anew. No image asked for before comes after this.

        Waits for an image that is being shown: not to be called with a lock held that its delivery needs.

        Args:
            board: how its camera is paced.
        """
        with self._showing:
            self._life += 1
            self._expected = None
        self.labels_board = not has_own_time(board)
        self.is_timeless |= self.labels_board
        self._label_offset_ns = None

    def stamp_ns(self, exposed_ns: int, offset_ns: int) -> int:
        """Give the stamp by which a frame of the board is paired.

        Labels, which the own camera's continue from the first one on, all go by the first one's clock offset: a better estimate may move
        the others by more than a fast film's period.

        Args:
            exposed_ns: its exposure on the host's clock by the offset of its own, ns.
            offset_ns: host's clock minus board's by which that was found, ns.
        """
        if not self.labels_board:
            return exposed_ns
        if self._label_offset_ns is None:
            self._label_offset_ns = offset_ns
        return exposed_ns + self._label_offset_ns - offset_ns

    def frame_came(self, stamp_ns: int, number: int) -> None:
        """Ask the own camera for the image that belongs to a frame of the board; does not wait for it.

        Args:
            stamp_ns: by which that frame is paired.
            number: its place in the board's life. Images of one number belong together if both cameras show labels; beside a board with a
                clock the own camera shows its images in their order, with labels from the first frame's stamp on.
        """
        if self.paces_own_camera:
            self._wants.put(_Want(self._life, stamp_ns, number if self.labels_board else None))

    def show_next(self, anchor: Callable[[int, int], None], show: Callable[[], None]) -> None:
        """Wait until an image is wanted and let it be shown; `wake` and a want of an earlier life end the wait with nothing shown.

        Args:
            anchor: called with a label and a number where the image after the last one shown is not the one that is wanted.
            show: reads the camera once and delivers what it gives.
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
        """Let `show_next` return; safe from any thread."""
        self._wants.put(None)
