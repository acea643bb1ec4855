"""How exact matchers are on pairs with known disparity, measured in this process: real scenes, and rendered rooms.

    python - <<END
    from tests.bench.depth_accuracy import default_cases, evaluate, mean, ratio
    cases = default_cases()
    print(ratio(evaluate("sgbm", cases), evaluate("3way", cases)))
    END

Columns, in percent of the pixels whose disparity is known and that both cameras see: density = with a value; bad1, bad2
= off by more than 1, 2 px, of those with a value; fill1, fill2 = the same over all of them, after each gap has taken the
smaller of its neighbours in the row; avg = mean error of those with a value, px. They are the columns by which the
project's accuracy has always been told (decision 0002).
"""

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import RectifiedPair
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import matcher_named
from phone_host.stereo.matcher_protocol import Matcher
from tests.bench.depth_rooms import rooms
from tests.bench.depth_scenes import CASES, Image, Values, scenes

COLUMNS: Final = ("density", "bad1", "bad2", "fill1", "fill2", "avg")
MEASURES: Final = COLUMNS[1:]
"""The columns in which less is better."""

ROOM: Final = "webcams"
"""The kind of every rendered room's case."""

ANCHORS: Final = ("3way", "3way+wls")
"""OpenCV's recipes that ours stand beside; the second needs OpenCV's contrib modules."""

WLS_ROWS: Final = Path(__file__).with_name("wls_rows.json")
"""What the second anchor scored on the real scenes: opencv-contrib-python-headless 4.14.0, 22 November 2026."""

Matching = Callable[[Image, Image, int], Values]
"""From two BGR images and N to a disparity map."""

MakeMatcher = Callable[[int], Matcher]
"""From N to a matcher."""


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One pair with known disparity.

    Attributes:
        scene: its name; several cases may show one scene.
        kind: how the images came to be: a key of `depth_scenes.CASES`, or ROOM.
        left: (H, W, 3) uint8.
        right: the same.
        truth: (H, W) float32, px; NaN: not counted.
        disparities: N, px.
    """

    scene: str
    kind: str
    left: Image
    right: Image
    truth: Values
    disparities: int

    @property
    def name(self) -> str:
        """Scene and kind."""
        return f"{self.scene} {self.kind}"


@dataclass(frozen=True, slots=True)
class Row:
    """Scores of one case, or means over several."""

    scene: str
    kind: str
    density: float
    bad1: float
    bad2: float
    fill1: float
    fill2: float
    avg: float

    @property
    def wrong2(self) -> float:
        """Pixels with a value that is off by more than 2 px, % of all that are counted."""
        return self.density * self.bad2 / 100.0

    @property
    def right2(self) -> float:
        """Pixels with a value that is off by at most 2 px, % of all that are counted."""
        return self.density - self.wrong2


def scene_cases(data: Path | None = None) -> Iterator[Case]:
    """Give the 20 cases of the real scenes.

    Args:
        data: the folder of real images; by default $SCAN_DATA.

    Raises:
        FileNotFoundError: an image is missing.
    """
    for scene in scenes(Path(os.environ["SCAN_DATA"]) if data is None else data):
        for kind in scene.cases:
            left, right = CASES[kind](scene.left, scene.right)
            yield Case(scene.name, kind, left, right, scene.truth, scene.disparities)


def room_cases(seeds: Sequence[int] | None = None) -> Iterator[Case]:
    """Give the rendered rooms.

    Args:
        seeds: of rooms of 640x480; by default these and some of 1280x720.
    """
    for room in rooms() if seeds is None else rooms(seeds, ()):
        yield Case(room.name, ROOM, room.left, room.right, room.truth, room.disparities)


def default_cases() -> list[Case]:
    """Real scenes, where $SCAN_DATA names them, and rendered rooms."""
    return [*(scene_cases() if os.environ.get("SCAN_DATA") else ()), *room_cases()]


def three_way(disparities: int, **changes: int) -> cv2.StereoSGBM:
    """OpenCV's tuned 3WAY recipe."""
    arguments = {
        "P1": 72,
        "P2": 288,
        "disp12MaxDiff": 1,
        "preFilterCap": 31,
        "uniquenessRatio": 10,
        "speckleWindowSize": 100,
        "speckleRange": 2,
        "mode": cv2.StereoSGBM_MODE_SGBM_3WAY,
    }
    return cv2.StereoSGBM.create(numDisparities=disparities, blockSize=3, **{**arguments, **changes})


def padded(image: Image, disparities: int) -> Image:
    """The image with N more columns on its left, so that OpenCV gives its first N columns values, too."""
    return np.asarray(cv2.copyMakeBorder(image, 0, 0, disparities, 0, cv2.BORDER_REPLICATE), np.uint8)


def grey(image: Image) -> Image:
    """The image in grey."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)


def searched(disparities: int) -> int:
    """The multiple of 16 that OpenCV searches."""
    return -(-disparities // 16) * 16


def by_three_way(left: Image, right: Image, disparities: int) -> Values:
    """The first anchor: StereoSGBM 3WAY, block 3, left border padded."""
    count = searched(disparities)
    found = three_way(count).compute(padded(grey(left), count), padded(grey(right), count))
    return _px(found[:, count:])


def by_three_way_wls(left: Image, right: Image, disparities: int) -> Values:
    """The second anchor: the same without checks, through OpenCV's WLS filter (lambda 500, sigma 0.8).

    Raises:
        AttributeError: this OpenCV has no contrib modules; see `has_wls`.
    """
    count = searched(disparities)
    contrib = cv2.ximgproc  # type: ignore[attr-defined]
    engine = three_way(count, disp12MaxDiff=-1, uniquenessRatio=0, speckleWindowSize=0)
    wls = contrib.createDisparityWLSFilter(engine)
    wls.setLambda(500)
    wls.setSigmaColor(0.8)
    wide_left, wide_right = padded(grey(left), count), padded(grey(right), count)
    from_right = contrib.createRightMatcher(engine).compute(wide_right, wide_left)
    found = wls.filter(engine.compute(wide_left, wide_right), padded(left, count), disparity_map_right=from_right)
    return _px(found[:, count:])


def has_wls() -> bool:
    """Whether this OpenCV has the WLS filter."""
    return hasattr(cv2, "ximgproc")


def _px(sixteenths: NDArray[Any]) -> Values:
    return sixteenths.astype(np.float32) / np.float32(16)


def matching(name: str) -> Matching:
    """Find a way of matching by name: an anchor, or a matcher of ours.

    Raises:
        SettingsError: no matcher has that name.
    """
    if name == ANCHORS[0]:
        return by_three_way
    if name == ANCHORS[1]:
        return by_three_way_wls
    named = matcher_named(name)
    return by_maker(lambda disparities: create_matcher(MatchSettings(named, disparities)))


def by_maker(make: MakeMatcher) -> Matching:
    """Match by a matcher made for each N."""
    made: dict[int, Matcher] = {}

    def match(left: Image, right: Image, disparities: int) -> Values:
        if disparities not in made:
            made[disparities] = make(disparities)
        return made[disparities].match(RectifiedPair(left, right))

    return match


def filled(found: Values) -> Values:
    """Fill each pixel without a value (NaN) with the smaller of the next values to its left and right; an empty row stays as it is."""
    columns = np.arange(found.shape[1])
    has = np.isfinite(found)
    before = np.maximum.accumulate(np.where(has, columns, -1), axis=1)
    after = np.minimum.accumulate(np.where(has, columns, len(columns))[:, ::-1], axis=1)[:, ::-1]
    sides = np.pad(found, ((0, 0), (1, 1)), constant_values=np.nan)
    rows = np.arange(found.shape[0])[:, None]
    return np.where(has, found, np.fmin(sides[rows, before + 1], sides[rows, after + 1]))


def score(case: Case, found: Values) -> Row:
    """Compare a disparity map with the truth. Values of 0 and below count as none, as in the reference's tables.

    Args:
        case: with its truth.
        found: (H, W) float32, px; NaN: none.
    """
    found = np.where(found > 0, found, np.float32(np.nan))
    counted = np.isfinite(case.truth)
    valued = counted & np.isfinite(found)
    error, after = np.abs(found - case.truth), np.abs(filled(found) - case.truth)

    def bad(errors: Values, among: NDArray[np.bool_], limit_px: float) -> float:
        # Not <=: a pixel that stays without a value is bad.
        return 100.0 * float((~(errors[among] <= limit_px)).mean()) if among.any() else 100.0

    return Row(
        scene=case.scene,
        kind=case.kind,
        density=100.0 * float(valued.sum() / counted.sum()),
        bad1=bad(error, valued, 1),
        bad2=bad(error, valued, 2),
        fill1=bad(after, counted, 1),
        fill2=bad(after, counted, 2),
        avg=float(error[valued].mean()) if valued.any() else float("inf"),
    )


def evaluate(matcher: str | MakeMatcher, cases: Sequence[Case]) -> list[Row]:
    """Match every case and score it.

    Args:
        matcher: a name (ours, or one of ANCHORS), or a callable that makes a matcher from N.
        cases: the pairs.

    Returns:
        One row a case, in their order.
    """
    match = matching(matcher) if isinstance(matcher, str) else by_maker(matcher)
    return [score(case, match(case.left, case.right, case.disparities)) for case in cases]


def mean(rows: Sequence[Row], kind: str = "", scene: str = "") -> Row:
    """Mean over all rows, or over those of one kind or scene; each case counts the same."""
    chosen = [row for row in rows if kind in {"", row.kind} and scene in {"", row.scene}]
    return Row(scene or "mean", kind, *(float(np.mean([getattr(row, name) for row in chosen])) for name in COLUMNS))


def better(rows: Mapping[str, Sequence[Row]]) -> Row:
    """The better of several anchors' means, column by column."""
    means = [mean(anchor) for anchor in rows.values()]
    least = (min(getattr(row, name) for row in means) for name in MEASURES)
    return Row("better anchor", "", max(row.density for row in means), *least)


def ratio(ours: Sequence[Row], anchor: Sequence[Row] | Row) -> Row:
    """Ratio of our means to an anchor's; below 1 ours are better. Density stays ours, in percent."""
    mine, theirs = mean(ours), anchor if isinstance(anchor, Row) else mean(anchor)
    shares = (getattr(mine, name) / max(getattr(theirs, name), 1e-9) for name in MEASURES)
    return Row("ratio", "", mine.density, *shares)


def anchor_rows(cases: Sequence[Case]) -> dict[str, list[Row]]:
    """The rows of the anchors: computed, or of the second as kept in WLS_ROWS where this OpenCV cannot compute it.

    A case that is not kept (a room, another folder of images) has the first anchor's row in both.
    """
    first = evaluate(ANCHORS[0], cases)
    if has_wls():
        return {ANCHORS[0]: first, ANCHORS[1]: evaluate(ANCHORS[1], cases)}
    kept = {(row["scene"], row["kind"]): Row(**row) for row in json.loads(WLS_ROWS.read_text(encoding="utf-8"))}
    return {ANCHORS[0]: first, ANCHORS[1]: [kept.get((row.scene, row.kind), row) for row in first]}


def main() -> None:
    """Write WLS_ROWS anew. Needs numpy and an OpenCV with contrib modules, no more, and $SCAN_DATA."""
    rows = [asdict(row) for row in evaluate(ANCHORS[1], list(scene_cases()))]
    WLS_ROWS.write_text("[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
