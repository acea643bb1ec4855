"""How exactly two recordings tell their offset by what they saw: `python -m tests.bench.bench_joining [--help]`.

Two unlike cameras on one rig, held by hand, look at two textured planes at 1.2 m and 3 m; each frame is rendered, blurred by its exposure, noisy
and a JPEG. Each camera has a clock, a rate and a brightness of its own. Counted is how often the true offset lies within what is stated (95 %).
`simulated` draws what is measured of the images instead of the images. Figures to reach: all are told, and the truth is within what is stated as
often as 95 % must be (chance takes more only once in a hundred); films of other hands are all refused. Exit 4 when a figure is missed.
"""

import argparse
import json
import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import cv2
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from common.frame import PixelFormat
from common.recording.recorded import Shown
from common.recording.ros_messages import RecordedImage
from phone_host.recording.offset_fit import fit_offset
from phone_host.recording.offset_search import Unclear, search_offset
from phone_host.recording.sight import Sight
from phone_host.recording.watching import watch
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.support.handheld import Eye, Floats, at, hand, simulated_sight

_ZERO_NS = 1_700_000_000 * 10**9
_TEXTURE_PX_M = 200.0
_TURN = np.radians([6.0, 8.0, 6.0])
"""Spread of the rig's turns, rad/s: a careful hand."""

_SHIFT_M = np.array([0.05, 0.05, 0.05])
_EXPOSURE_S = 0.012
_CHANCE = 0.01


def _texture(seed: int, width_m: float, height_m: float) -> np.ndarray:
    """Return a surface with detail of all sizes, (H, W) float32."""
    chance = np.random.default_rng(seed)
    size = int(width_m * _TEXTURE_PX_M), int(height_m * _TEXTURE_PX_M)
    total = np.zeros(size[::-1], np.float32)
    for cells in (8, 32, 128):
        grid = chance.random((cells * size[1] // size[0] + 1, cells), np.float32)
        total += cv2.resize(grid, size, interpolation=cv2.INTER_CUBIC) / np.float32(np.sqrt(cells))
    low, high = float(total.min()), float(total.max())
    return np.asarray(20 + 215 * (total - low) / (high - low), np.float32)


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """A camera: focal length, px of its 192x144 image, where it stands, m, how it is turned about its axis, rad, and its clock."""

    eye: Eye
    focal_px: float = 170.0
    x_m: float = 0.0
    roll: float = 0.0
    lit: float = 1.0


def film(
    chance: np.random.Generator, positions: Floats, look: Look, planes: Sequence[tuple[np.ndarray, float]]
) -> list[Shown]:
    """Return the images of a camera on a rig that is held by hand."""
    shown = []
    for number, moment in enumerate(look.eye.moments(chance)):
        early, late = at(positions, np.array([moment - _EXPOSURE_S / 3, moment + _EXPOSURE_S / 3]))
        picture = (_rendered(look, early, planes) + _rendered(look, late, planes)) / 2
        picture = picture * look.lit * (1 + 0.05 * np.sin(moment * (0.7 + look.x_m))) + chance.normal(
            0, 3, picture.shape
        )
        done, jpeg = cv2.imencode(".jpg", np.clip(picture, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 80])
        assert done
        stamp_ns = _ZERO_NS + round(float(look.eye.clock(np.array([moment]))[0]) * 1e9)
        image = RecordedImage(stamp_ns, "left", PixelFormat.MJPEG, (0, 0), jpeg.tobytes())
        shown.append(Shown(image, number, stamp_ns, stamp_ns, stamp_ns))
    return shown


def _rendered(look: Look, pose: Floats, planes: Sequence[tuple[np.ndarray, float]]) -> Floats:
    turn = cv2.Rodrigues(np.asarray([0, 0, look.roll], float))[0] @ cv2.Rodrigues(pose[:3] * _TURN)[0]
    centre = pose[3:] * _SHIFT_M + turn.T @ [look.x_m, 0, 0]
    lens = np.array([[look.focal_px, 0, 95.5], [0, look.focal_px, 71.5], [0, 0, 1]])
    picture = np.zeros((144, 192), np.float32)
    for texture, depth_m in planes:  # the far one first
        height, width = texture.shape
        on_plane = np.array(
            [
                [1 / _TEXTURE_PX_M, 0, -width / 2 / _TEXTURE_PX_M],
                [0, 1 / _TEXTURE_PX_M, -height / 2 / _TEXTURE_PX_M],
                [0, 0, 1],
            ]
        )
        points = np.column_stack([turn[:, 0], turn[:, 1], turn @ (np.array([0, 0, depth_m]) - centre)]) @ on_plane
        cv2.warpPerspective(texture, lens @ points, (192, 144), picture, cv2.INTER_LINEAR, cv2.BORDER_TRANSPARENT)
    return np.asarray(picture, np.float64)


@dataclass(frozen=True, slots=True)
class Answer:
    """What one pair of recordings told: error and stated half-width, s; or why nothing."""

    error_s: float = 0.0
    stated_s: float = 0.0
    refused: Unclear | None = None


def judged(first: Sight, second: Sight, offset_s: float, drift: float) -> Answer:
    """Compare with the truth: the first clock shows t (1 + drift) + offset, the second t, t counted from the second's zero."""
    found = search_offset(first, second)
    if isinstance(found, Unclear):
        return Answer(refused=found)
    fitted = fit_offset(first, second, found.offset_s)
    return Answer(fitted.offset_s - offset_s - drift * fitted.at_s, fitted.uncertainty_s)


def rendered(seed: int, seconds: float, rates: tuple[float, float] = (30, 30), *, common: bool = True) -> Answer:
    """Film and judge; without `common`, the cameras film different hands."""
    chance = np.random.default_rng(seed)
    far, near = _texture(seed, 14, 11), _texture(seed + 1, 0.7, 0.5)
    planes = ((far, 3.0), (near, 1.2))
    positions = hand(chance, seconds + 10, 6)
    others = positions if common else hand(chance, seconds + 10, 6)
    offset_s, drift = float(chance.uniform(-20, 20)), float(chance.normal(0, 40e-6))
    eyes = (
        Eye(begin_s=0, end_s=seconds + 5, rate_hz=rates[0], offset_s=offset_s, drift=drift),
        Eye(begin_s=5, end_s=seconds + 10, rate_hz=rates[1]),
    )
    board = Look(eye=eyes[0], roll=float(chance.normal(0, 0.05)))
    host = Look(eye=eyes[1], focal_px=210, x_m=0.1, roll=float(chance.choice([0, np.pi / 2])), lit=0.7)
    first, second = film(chance, positions, board, planes), film(chance, others, host, planes)
    return judged(watch(first, _ZERO_NS, lambda _: None), watch(second, _ZERO_NS, lambda _: None), offset_s, drift)


def simulated(seed: int, seconds: float, rates: tuple[float, float] = (30, 30), noise_px: float = 0.1) -> Answer:
    """Draw what is measured, and judge."""
    chance = np.random.default_rng(seed)
    positions = hand(chance, seconds + 10)
    parallax = positions + 0.2 * hand(chance, seconds + 10)
    offset_s, drift = float(chance.uniform(-50, 50)), float(chance.normal(0, 40e-6))
    first = Eye(begin_s=0, end_s=seconds + 5, rate_hz=rates[0], noise_px=noise_px, offset_s=offset_s, drift=drift)
    second = Eye(begin_s=5, end_s=seconds + 10, rate_hz=rates[1], noise_px=noise_px)
    return judged(simulated_sight(chance, positions, first), simulated_sight(chance, parallax, second), offset_s, drift)


OTHERS = "rendered, other hands"
CASES: dict[str, Callable[[int], Answer]] = {
    "rendered, 10 s in common": lambda seed: rendered(seed, 10),
    "rendered, 20 s, 30 and 30 /s": lambda seed: rendered(seed, 20),
    "rendered, 20 s, 30 and 15 /s": lambda seed: rendered(seed, 20, (30, 15)),
    "simulated, 10 s": lambda seed: simulated(seed, 10),
    "simulated, 60 s": lambda seed: simulated(seed, 60),
    "simulated, 60 s, 30 and 25 /s, noisy": lambda seed: simulated(seed, 60, (30, 25), 0.3),
    OTHERS: lambda seed: rendered(seed, 20, common=False),
}


def least_within(count: int) -> int:
    """Return how many of so many answers must hold what they state with 95 %: fewer come by chance only once in a hundred."""
    chance, least = 0.0, 0
    while (chance := chance + math.comb(count, least) * 0.95**least * 0.05 ** (count - least)) <= _CHANCE:
        least += 1
    return least


def verdicts(case: str, answers: Sequence[Answer]) -> Iterator[Verdict]:
    """Judge the answers of a case."""
    told, count = [answer for answer in answers if answer.refused is None], len(answers)
    if case == OTHERS:
        yield Verdict(f"{case}: refused", not told, f"{count - len(told)} of {count}", "all")
        return
    within, least = sum(abs(answer.error_s) <= answer.stated_s for answer in told), least_within(len(told))
    yield Verdict(f"{case}: told", len(told) == count, f"{len(told)} of {count}", "all")
    found = f"{within} of {len(told)}"
    yield Verdict(f"{case}: the truth within what is stated", within >= least, found, f"95 %: {least} at least")


def row(case: str, answers: Sequence[Answer]) -> dict[str, Any]:
    """Return the figures of a case."""
    told = [answer for answer in answers if answer.refused is None]
    errors_ms = np.array([answer.error_s for answer in told]) * 1e3
    return {
        "case": case,
        "told": len(told),
        "refused": dict(Counter(answer.refused.name for answer in answers if answer.refused)),
        "rms_ms": float(np.sqrt(np.mean(errors_ms**2))) if told else None,
        "mean_ms": float(errors_ms.mean()) if told else None,
        "stated_ms": float(np.median([answer.stated_s for answer in told])) * 1e3 if told else None,
    }


def main() -> int:
    """Run all cases, print a table and judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=200, help="of each simulated case (default 200)")
    parser.add_argument("--films", type=int, default=40, help="of each rendered case (default 40)")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--only", default="", help="cases whose name holds this")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    rows, judged_all = list[dict[str, Any]](), list[Verdict]()
    for name, case in CASES.items():
        if options.only not in name:
            continue
        seeds = range(options.first, options.first + (options.films if "rendered" in name else options.seeds))
        answers = [case(seed) for seed in track(seeds, name, console=Console(stderr=True))]
        rows.append(row(name, answers))
        judged_all += verdicts(name, answers)
    if options.json:
        print(json.dumps({"machine": asdict(machine()), "rows": rows, "verdicts": [asdict(one) for one in judged_all]}))
        return exit_code(judged_all)
    table = Table("case", "told", "refused", "error, RMS ms", "mean ms", "stated (95 %), ms", title=str(machine()))
    for each in rows:
        numbers = ["-" if each[key] is None else f"{each[key]:.3g}" for key in ("rms_ms", "mean_ms", "stated_ms")]
        table.add_row(each["case"], str(each["told"]), str(each["refused"] or "-"), *numbers)
    Console().print(table)
    for verdict in judged_all:
        Console().print(str(verdict))
    return exit_code(judged_all)


if __name__ == "__main__":
    sys.exit(main())
