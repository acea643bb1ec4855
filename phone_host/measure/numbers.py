"""Says in words when two replays show different images as a pair. Pure.

Two folders that belong together hold the same numbers. If they do not, images were added, lost or renamed on one side,
or one side began earlier; then pairs may be of different moments, and their depth is wrong without looking wrong.
"""

from dataclasses import dataclass
from typing import Final, assert_never

from common.camera.image_numbers import ImageNumbers
from phone_host.measure.trust import Concern, Doubt
from phone_host.sync.stills import PairedBy


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageEvidence:
    """What is known of the images of two replays.

    Attributes:
        paired_by: what says which images belong together.
        board: the board's images; None if it does not replay, or does not tell.
        own: this machine's images; None if it does not replay.
        pairs: pairs so far.
        board_alone: board images of whose number this machine has none.
        own_alone: images of this machine of whose number the board has shown none.
        apart: pairs whose two images are at different places in their films.
        first_apart: the places of the first of them, board and host, from 0.
    """

    paired_by: PairedBy = PairedBy.TIME
    board: ImageNumbers | None = None
    own: ImageNumbers | None = None
    pairs: int = 0
    board_alone: int = 0
    own_alone: int = 0
    apart: int = 0
    first_apart: tuple[int, int] = (0, 0)


class FilmWatch:
    """Watches whether the pairs of two films, both shown by a clock, are of the same place in them."""

    def __init__(self) -> None:
        self._comparable = False
        self.pairs = self.apart = 0
        self.first_apart = (0, 0)

    def begin(self, board: ImageNumbers | None, own: ImageNumbers | None, *, by_time: bool) -> None:
        """Begin a board session. Only of films that run once do the sequences tell the place."""
        runs_once = board is not None and own is not None and not board.looped and not own.looped
        self._comparable = by_time and runs_once

    def lowered(self) -> None:
        """The board's camera leaves images out from now on."""
        self._comparable = False

    def pair(self, board_sequence: int, own_sequence: int) -> None:
        """Take note of a pair."""
        self.pairs += 1
        if self._comparable and board_sequence != own_sequence:
            self.first_apart = self.first_apart if self.apart else (board_sequence, own_sequence)
            self.apart += 1


_STILLS: Final = (
    "leave fps=, loop=, phase_ms= and pace= out on both sides to pair photographs by number, or give loop=1 on both"
)
_SERIES: Final = (
    "check that both folders are of one series: the numbers in the file names say which two images belong together"
)


def number_concerns(evidence: ImageEvidence) -> tuple[Concern, ...]:
    """Say why pairs of two replays may show different moments; empty before the first pair, and if there is no reason."""
    board, own = evidence.board, evidence.own
    if board is None or own is None or not evidence.pairs + evidence.board_alone + evidence.own_alone:
        return ()
    both = f"the board shows {board.words}, this machine {own.words}"
    match evidence.paired_by:
        case PairedBy.NUMBER:
            sentence, remedy = _by_number(evidence, both, alike=_range(board) == _range(own)), _SERIES
        case PairedBy.ORDER:
            sentence = f"{both}, and they are paired in their order: a missing one shifts all that follow"
            sentence = sentence if board.count != own.count else ""
            remedy = "number the files of both sides alike, such as 0012.jpg"
        case PairedBy.TIME if evidence.apart:
            sentence, remedy = _apart(evidence), _STILLS
        case PairedBy.TIME:
            sentence, remedy = f"{both}: two films of different length do not belong together", _SERIES
            sentence = sentence if board.count != own.count else ""
        case _:
            assert_never(evidence.paired_by)
    return (Concern(Doubt.IMAGE_NUMBERS, sentence, remedy),) if sentence else ()


def _range(images: ImageNumbers) -> tuple[int, int | None, int | None]:
    return images.count, images.first, images.last


def _by_number(evidence: ImageEvidence, both: str, *, alike: bool) -> str:
    there, here = evidence.board_alone, evidence.own_alone
    if not there and not here:
        return "" if alike else both
    return f"{both}: {there} of the board's and {here} of this machine's had no partner of the same number so far"


def _apart(evidence: ImageEvidence) -> str:
    there, here = evidence.first_apart
    return (
        f"{evidence.apart} of {evidence.pairs} pairs are of different images: first of image {there} of the board and"
        f" image {here} of this machine, counted from 0"
    )
