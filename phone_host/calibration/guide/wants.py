"""The views that a calibration needs, when one of them is there, which image corners nobody has shown, and all that a person is told until then. Pure.

Left, right, top and bottom are those of the pictures as the cameras take them, not mirrored. A place counts where it is
reached in the picture in which the board is nearer to that edge: the two pictures overlap, so only one of them can show the
board at its outer edge.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from common.words import counted
from phone_host.calibration.guide.coverage import Depth, Placement, placement
from phone_host.calibration.solve.bundle_problem import Bend
from phone_host.calibration.solve.next_view import Spot
from phone_host.calibration.solve.verdict import Assessment, Calibration
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair
from phone_host.model import CameraModel, Verdict

_TILT_DEG, _ASKED_TILT_DEG = 18.0, 30.0
"""A board counts as tilted from the first on; the second is what is imagined. Below 15 a focal length is hardly told from a
distance."""

_EDGE: Final = 0.14
"""A corner of the board that is this near to an edge, in image sizes beside the board's own outer square, has reached it. A person who is
told to stop there stops half a second later, and must not have left the picture by then."""

_REACH: Final = 0.6
"""A corner of the image is seen if a corner of the board lies within this share of the way to it, across and down, in one picture.
Lenses fitted to views that reach half of it were off by 2 to 3 times what they stated (30 rendered rigs with k3)."""

_NEAR_FILLS, _FAR_FILLS = Depth.MIDDLE.value, Depth.FAR.value
_LEAST_FILLS, _MOST_FILLS, _CORNER_FILLS = 0.15, 0.65, 0.5
"""For all other views: a smaller board has coarse corners, a larger one can hardly be tilted, or fits into no corner."""

_OFF_MIDDLE: Final = 0.1
"""A board in a corner has its middle so far from that of both pictures, in image sizes: a large one is near all edges at once."""

_ASIDE: Final = 0.26


class Want(Enum):
    """A view that is wanted; its value is what a person is told."""

    ANY = "show the board"
    LEFT_AWAY = "tilt the board: left edge away"
    TOP_LEFT = "top left corner"
    TOP_AWAY = "tilt the board: top edge away"
    BOTTOM_RIGHT = "bottom right corner"
    NEAR = "closer"
    RIGHT_AWAY = "tilt the board: right edge away"
    TOP_RIGHT = "top right corner"
    BOTTOM_AWAY = "tilt the board: bottom edge away"
    BOTTOM_LEFT = "bottom left corner"
    FAR = "farther away"


ORDER: Final = tuple(want for want in Want if want is not Want.ANY)
"""The order in which views are wanted while the calibration does not tell which one helps most."""

_TILTS: Final = {
    Want.LEFT_AWAY: (1, 0),
    Want.RIGHT_AWAY: (-1, 0),
    Want.TOP_AWAY: (0, 1),
    Want.BOTTOM_AWAY: (0, -1),
}
_CORNERS: Final = {
    Want.TOP_LEFT: (-1, -1),
    Want.TOP_RIGHT: (1, -1),
    Want.BOTTOM_LEFT: (-1, 1),
    Want.BOTTOM_RIGHT: (1, 1),
}
CORNERS: Final = frozenset(_CORNERS)
"""What must be seen before a calibration is called good: beyond the outermost corners a lens is guessed."""

_EDGES: Final = {(-1, 0): "left edge", (1, 0): "right edge", (0, -1): "top edge", (0, 1): "bottom edge"}
_CLOSER, _FARTHER = Want.NEAR.value, Want.FAR.value


@dataclass(frozen=True, slots=True)
class Placed:
    """A board in both images.

    Attributes:
        left: in the left one.
        right: in the right one.
    """

    left: Placement
    right: Placement

    @property
    def fills(self) -> float:
        """Share of the width that the board would fill frontally, mean of both images."""
        return (self.left.fills + self.right.fills) / 2


def ahead(before: Placed, now: Placed, steps: float) -> Placed:
    """Return where a board will be that goes on as it went between two looks, so many times that time ahead."""
    return Placed(_shifted(before.left, now.left, steps), _shifted(before.right, now.right, steps))


def _shifted(before: Placement, now: Placement, steps: float) -> Placement:
    x, y = ((now.low[axis] + now.high[axis] - before.low[axis] - before.high[axis]) / 2 * steps for axis in (0, 1))
    return replace(
        now,
        low=(now.low[0] + x, now.low[1] + y),
        high=(now.high[0] + x, now.high[1] + y),
        nearest=tuple((across + x, down + y) for across, down in now.nearest),
    )


def spot_of(want: Want) -> Spot:
    """Return where the board would stand in a wanted view."""
    if want in _TILTS:
        across, down = _TILTS[want]
        return Spot(tilt_deg=(across * _ASKED_TILT_DEG, down * _ASKED_TILT_DEG))
    if want in _CORNERS:
        x, y = _CORNERS[want]
        return Spot(aside=(x * _ASIDE, y * _ASIDE))
    match want:
        case Want.NEAR:
            return Spot(fills=_NEAR_FILLS)
        case Want.FAR:
            return Spot(fills=_FAR_FILLS)
        case _:
            return Spot()


def is_there(want: Want, placed: Placed) -> bool:
    """Return whether a view is the one that is wanted."""
    return not missing(want, placed)


def missing(want: Want, placed: Placed) -> str:
    """Return what a person is to do until a wanted view is there, in a few words; empty: it is."""
    if want is Want.NEAR:
        return (
            "" if placed.fills >= _NEAR_FILLS or _is_full(placed) else ", ".join(filter(None, (_CLOSER, back(placed))))
        )
    if want is Want.FAR:
        return _FARTHER if placed.fills > _FAR_FILLS else ""
    most = _CORNER_FILLS if want in _CORNERS else _MOST_FILLS
    size = _CLOSER if placed.fills < _LEAST_FILLS else _FARTHER if placed.fills > most else ""
    parts = [_way(want, placed), size]
    return ", ".join(part for part in parts if part)


def back(placed: Placed) -> str:
    """Return how a board that is about to leave one of the pictures comes back, in a few words; empty: it is far from all edges."""
    if _is_full(placed):
        return _FARTHER
    x = next((way for way in (-1, 1) if _reached(placed, way, 0)), 0)
    y = next((way for way in (-1, 1) if _reached(placed, 0, way)), 0)
    corner = next((want for want, ways in _CORNERS.items() if ways == (x, y)), None)
    where = corner.value if corner is not None else _EDGES.get((x, y))
    return "" if where is None else f"back from the {where}"


def is_seen(want: Want, placed: Placed) -> bool:
    """Return whether the board reaches into a corner of one of the pictures, whatever else it does."""
    return max(each.reach(*_CORNERS[want]) for each in (placed.left, placed.right)) >= _REACH


def _way(want: Want, placed: Placed) -> str:
    if want in _TILTS:
        across, down = placed.left.tilt_deg
        way = _TILTS[want]
        return "" if across * way[0] + down * way[1] >= _TILT_DEG else want.value
    if want in _CORNERS:
        x, y = _CORNERS[want]
        left_out = [way for way in ((x, 0), (0, y)) if not (_reached(placed, *way) and _off_middle(placed, *way))]
        if not left_out and is_seen(want, placed):
            return ""
        return _EDGES[left_out[0]] if len(left_out) == 1 else want.value
    return ""


def _is_full(placed: Placed) -> bool:
    """Return whether the board has reached opposite edges, be it of different pictures: both cameras see no more of it."""
    return any(_reached(placed, x, y) and _reached(placed, -x, -y) for x, y in ((1, 0), (0, 1)))


def _off_middle(placed: Placed, x: int, y: int) -> bool:
    """Return whether the board's middle is on one side of that of the pictures."""
    axis = 0 if x else 1
    middles = [(each.low[axis] + each.high[axis]) / 2 - 0.5 for each in (placed.left, placed.right)]
    return (x + y) * sum(middles) / 2 >= _OFF_MIDDLE


def _reached(placed: Placed, x: int, y: int) -> bool:
    """Return whether the board has reached an edge of one of the pictures."""
    axis = 0 if x else 1
    return any(
        (each.low[axis] if x + y < 0 else 1 - each.high[axis]) - each.square[axis] <= _EDGE
        for each in (placed.left, placed.right)
    )


def unseen(places: Iterable[Placed]) -> frozenset[Want]:
    """Return the image corners that no board reaches."""
    left = set(CORNERS)
    for placed in places:
        left -= {want for want in left if is_seen(want, placed)}
    return frozenset(left)


def unseen_in(pairs: Iterable[BoardPair], board: Board, left: CameraModel, right: CameraModel) -> frozenset[Want]:
    """Return the image corners that the board reaches in none of some pairs; of the cameras only the sizes count."""
    return unseen(
        Placed(placement(pair.left_px, board, left), placement(pair.right_px, board, right)) for pair in pairs
    )


def guessed_corners(found: Calibration, pairs: Iterable[BoardPair], board: Board) -> frozenset[Want]:
    """Return the image corners that the board reaches in none of the pairs (as they were seen) that a calibration used, if a lens is guessed there."""
    if not is_guessed(found.bends):
        return frozenset()
    used = {each.name for each in found.used}
    return unseen_in((pair for pair in pairs if pair.name in used), board, found.rig.left, found.rig.right)


def is_guessed(bends: Iterable[Bend]) -> bool:
    """Return whether a lens may bend freely where nothing was seen: one of more than four coefficients.

    Beyond what was seen the powers of the fifth coefficient and more run away; four stay near the truth, because webcams' lenses follow them.
    """
    return any(bend is not Bend.USUAL for bend in bends)


def with_corners(judgement: Assessment, missing: Iterable[Want]) -> Assessment:
    """Return a verdict that promises nothing of what was not seen: good becomes usable where corners are missing."""
    names = [want.value for want in ORDER if want in set(missing)]
    if judgement.verdict is not Verdict.GOOD or not names:
        return judgement
    where = " or ".join(filter(None, (", ".join(names[:-1]), names[-1])))
    remedy = f"no board was seen in the {where} of the pictures, so the lens is guessed there: take views with it there"
    return Assessment(Verdict.USABLE, remedy)


class Words(Enum):
    """What a person is told; beside these: what a wanted view lacks, and `taken`."""

    SHOW_BOTH = "show the whole board to both cameras"
    SHOW_LEFT = "the left camera sees too little of the board: move it to the left, or farther away"
    SHOW_RIGHT = "the right camera sees too little of the board: move it to the right, or farther away"
    PART = "show more of the board"
    SAME = "both cameras show the same picture: choose two different cameras"
    HELP = "no board found: more light, no glare, the whole board with its white margin; or name its inner corners"
    STILL = "hold still"
    BLURRED = "too blurred: hold still, more light"
    GLARE = "glare: turn the board a little"
    ELSEWHERE = "move the board a little"


def taken(views: int) -> str:
    """Return what is said when a view is taken."""
    return f"taken, {views}"


def done(verdict: str, views: int) -> str:
    """Return what is said at the end."""
    return f"done: verdict {verdict}" if verdict else f"done: {counted(views, 'view')}"


_STEADY_NS: Final = 400_000_000
"""The reason for new words must last so long: a board may be between two looks."""

_READ_NS: Final = 1_000_000_000
"""So long words stand: nobody reads, or follows, what changes faster."""


class Speech:
    """What is being said. Words change only when a person has had the time to read them."""

    def __init__(self) -> None:
        self.words = ""
        self._since_ns = self._next_since_ns = 0
        self._next = ""

    def say(self, wanted: str, now_ns: int, *, is_news: bool) -> str:
        """Return what is said now.

        Args:
            wanted: what is to be said; empty: nothing new.
            now_ns: now.
            is_news: whether it is said at once, whatever stands: a view was taken, or all is done.
        """
        if wanted != self._next:
            self._next, self._next_since_ns = wanted, now_ns
        if not wanted or wanted == self.words:
            return self.words
        # A hand that is to hold still has gone on a moment later.
        is_steady = wanted == Words.STILL.value or now_ns - self._next_since_ns >= _STEADY_NS
        if is_news or not self.words or (is_steady and now_ns - self._since_ns >= _READ_NS):
            self.words, self._since_ns = wanted, now_ns
        return self.words
