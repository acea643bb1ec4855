"""Says in words when two replays show different images as a pair. Pure.

Two folders that belong together hold the same numbers. If they do not, images were added, lost or renamed on one side,
or one side began earlier; then pairs may be of different moments, and their depth is wrong without looking wrong.
"""

import math
from dataclasses import dataclass, replace
from typing import Final, assert_never

from common.camera.image_numbers import ImageNumbers
from common.diagnostic import Diagnostic, Severity
from common.words import counted
from phone_host.diagnostics.codes import Code, Misplaced, diagnose
from phone_host.model import Arrangement
from phone_host.sync.stills import PairedBy, WhyOrder

MOST_NAMED: Final = 5
"""Images without a partner that are named; the others are counted."""

_SAME_RATE: Final = 0.01
"""Rates that differ by less are the same one, rounded."""


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
        board_numbers: the numbers of the first of the board's images that are alone, `MOST_NAMED` at most.
        own_numbers: the same of this machine's.
        why_order: why images are paired in their order; None if they are not.
        apart: pairs whose two images are at different places in their films.
        first_apart: the places of the first of them, board and host, from 0.
        board_period_ns: time between the board's images, ns; 0: not known, or images come on demand.
        own_period_ns: time between this machine's.
    """

    paired_by: PairedBy = PairedBy.TIME
    board: ImageNumbers | None = None
    own: ImageNumbers | None = None
    pairs: int = 0
    board_alone: int = 0
    own_alone: int = 0
    board_numbers: tuple[int, ...] = ()
    own_numbers: tuple[int, ...] = ()
    why_order: WhyOrder | None = None
    apart: int = 0
    first_apart: tuple[int, int] = (0, 0)
    board_period_ns: int = 0
    own_period_ns: int = 0


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


def number_concerns(evidence: ImageEvidence) -> tuple[Diagnostic, ...]:
    """Say why pairs of two replays may show different moments; empty before the first pair, and if there is no reason."""
    board, own = evidence.board, evidence.own
    if board is None or own is None or not evidence.pairs + evidence.board_alone + evidence.own_alone:
        return ()
    match evidence.paired_by:
        case PairedBy.NUMBER:
            return _by_number(evidence, board, own)
        case PairedBy.ORDER:
            return _by_order(evidence.why_order, board, own)
        case PairedBy.TIME:
            return _by_time(evidence, board, own)
        case _:
            assert_never(evidence.paired_by)


def _by_number(evidence: ImageEvidence, board: ImageNumbers, own: ImageNumbers) -> tuple[Diagnostic, ...]:
    """Pairs of one number belong together: what has no partner makes none of them doubtful."""
    alike = (board.count, board.first, board.last) == (own.count, own.first, own.last)
    sides = (
        _alone("the board", evidence.board_alone, evidence.board_numbers),
        _alone("this machine", evidence.own_alone, evidence.own_numbers),
    )
    alone = " and ".join(side for side in sides if side)
    if alike and not alone:
        return ()
    if not alone:
        # The words leave times out.
        times = ", the first or last ones of other times" if board.words == own.words else ""
        sentence = f"the board shows {board.words}, this machine {own.words}{times}"
    else:
        has = "has" if evidence.board_alone + evidence.own_alone == 1 else "have"
        sentence = (
            f"{alone} {has} no partner of the same number: the board shows {board.words}, this machine {own.words}"
        )
    return (
        diagnose(
            Code.IMAGE_NUMBERS,
            sentence,
            "check that both folders are of one series: the number in the file name says which two images belong together",
            severity=Severity.NOTE,
        ),
    )


def _alone(side: str, images: int, numbers: tuple[int, ...]) -> str:
    """Name the images of a side that have no partner, as far as their numbers are known."""
    if not images:
        return ""
    named = ", ".join(str(number) for number in numbers)
    if images == 1:
        return f"image {named} of {side}" if named else f"1 image of {side}"
    more = ", ..." if len(numbers) < images else ""
    return f"{images} images of {side}{f' ({named}{more})' if named else ''}"


def _by_order(why: WhyOrder | None, board: ImageNumbers, own: ImageNumbers) -> tuple[Diagnostic, ...]:
    if why is WhyOrder.OTHER:
        return (
            diagnose(
                Code.IMAGE_NUMBERS,
                f"the board shows {board.words}, this machine {own.words}, paired in their order: the numbers in the names of one side are not those of the other",
                "give the two images of one moment the same number in their names",
            ),
        )
    if why is WhyOrder.LATE:
        return (
            diagnose(
                Code.IMAGE_NUMBERS,
                f"the board shows {board.words}, this machine {own.words}, paired in their order: numbers are missing on the board, and it had shown its first images before this run",
                "start board-agent again, so that this run gets its first image",
            ),
        )
    if board.count == own.count:
        return ()
    untold = own.first is not None and board.first is None
    return (
        diagnose(
            Code.IMAGE_NUMBERS,
            f"the board shows {board.words}, this machine {own.words}, paired in their order: a missing one shifts all that follow",
            "number the files of both sides alike, such as 0012.jpg; if they are, update board-agent: it does not tell the numbers"
            if untold
            else "number the files of both sides alike, such as 0012.jpg",
        ),
    )


def pairing_words(evidence: ImageEvidence) -> str:
    """Say what paired the images of two folders of stills; empty for anything else."""
    if evidence.board is None or evidence.paired_by is PairedBy.TIME:
        return ""
    match evidence.why_order:
        case None:
            return "stills, paired by the numbers in their names"
        case WhyOrder.UNKNOWN:
            why = "the names of one side do not number them, or its numbers are not known"
        case WhyOrder.OTHER:
            why = "the numbers in the names of one side are not those of the other"
        case WhyOrder.LATE:
            why = "the board had shown its first images before this run"
        case _:
            assert_never(evidence.why_order)
    return f"stills, paired in their order: {why}"


def _by_time(evidence: ImageEvidence, board: ImageNumbers, own: ImageNumbers) -> tuple[Diagnostic, ...]:
    there, here = evidence.first_apart
    if evidence.apart:
        found = diagnose(
            Code.IMAGE_NUMBERS,
            f"{evidence.apart} of {counted(evidence.pairs, 'pair')} are of different images: first of image {there} of the board"
            f" and image {here} of this machine, counted from 0",
            "give both films loop=1; or, for photographs, leave fps=, loop=, phase_ms= and pace= out on both sides",
        )
        are_most = 2 * evidence.apart > evidence.pairs
        return (_apart(found) if are_most else found,)
    rates = (evidence.board_period_ns, evidence.own_period_ns)
    if not all(rates) or abs(rates[0] - rates[1]) <= _SAME_RATE * max(rates):
        if board.count == own.count:
            return ()
        # The time alone says which image of a loop is shown: equal ones meet while both are in the same round.
        most_apart = board.looped and own.looped and math.lcm(board.count, own.count) > 2 * min(board.count, own.count)
        return (
            diagnose(
                Code.IMAGES_APART if most_apart else Code.IMAGE_NUMBERS,
                f"the board shows {board.words}, this machine {own.words}: films of different length drift apart",
                "give two films of one recording, with as many images",
            ),
        )
    if abs(board.count * rates[0] - own.count * rates[1]) <= max(rates):
        return ()  # the same seconds, filmed at two rates
    shown = [f"{numbers.words} at {1e9 / rate:.3g} /s" for numbers, rate in zip((board, own), rates, strict=True)]
    return (
        diagnose(
            Code.IMAGE_NUMBERS,
            f"the board shows {shown[0]}, this machine {shown[1]}: films of different rate drift apart",
            "give both films the fps= that they were recorded with",
        ),
    )


def _apart(found: Diagnostic) -> Diagnostic:
    return replace(found, code=Code.IMAGES_APART, severity=Severity.FAIL)


_CONSEQUENCES: Final = frozenset({Code.SWAPPED, Code.OTHER_SCENE})

_OF_BOTH: Final = frozenset({Arrangement.BOTH_TURNED, Arrangement.BOTH_MIRRORED, Arrangement.BOTH_TURNED_BY_QUARTER})
"""What two images of different moments may look like. One camera turned or mirrored looks so at any moment."""


def with_cause(
    numbers: tuple[Diagnostic, ...], images: tuple[Diagnostic, ...], evidence: ImageEvidence
) -> tuple[tuple[Diagnostic, ...], tuple[Diagnostic, ...]]:
    """Blame how two films are paired, and not the cameras, for what pairs of different moments look like.

    Returns:
        Both, with the cause of depth that cannot be right in the first.
    """
    kept = tuple(concern for concern in images if blamed(concern, numbers, evidence) is concern)
    if len(kept) == len(images):
        return numbers, images
    return tuple(_apart(concern) for concern in numbers), kept


def blamed(concern: Diagnostic, numbers: tuple[Diagnostic, ...], evidence: ImageEvidence) -> Diagnostic:
    """Return the cause of what an image shows: the concern itself, or that the pairs are of different moments.

    Args:
        concern: about what the images show.
        numbers: the concerns about the images' numbers.
        evidence: of the numbers. Images paired by their numbers are of one moment, and show what they show.
    """
    seen = concern.evidence
    may_be = concern.code in _CONSEQUENCES or (isinstance(seen, Misplaced) and seen.arrangement in _OF_BOTH)
    if not may_be or not numbers or evidence.paired_by is PairedBy.NUMBER:
        return concern
    return _apart(numbers[0])
