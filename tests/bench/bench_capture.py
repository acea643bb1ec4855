"""Whether stabilised films are told from those of rigid cameras: `python -m tests.bench.bench_capture [--help]`.

Rendered films of four kinds of places, filmed by hand with a rolling shutter, each twice: as the sensor saw it, and as one of
five stabilisers made it smoother, weakly or strongly. Lens, angle of view, readout, size, rate, noise, JPEG quality and motion are
drawn anew; somebody walks by, automatic exposure swings, the light is low. The lens that the check is given is off as a calibration
is. A film goes on as long as the check cannot tell, as its user would: four stretches, at most eight. Beside them films that tell nothing: a
plain wall, a poster, a camera on a table. Exit 4 when a figure is missed.
"""

import argparse
import json
import multiprocessing
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from phone_host.doctor.camera_check.check import CaptureCheck, Plan
from phone_host.doctor.camera_check.look import FRAMES, look
from phone_host.model import CameraModel
from phone_host.model.capture import CaptureSource, Rigidity, Warping
from tests.bench.capture_films import Place, Stabiliser, Take, film, lens_of
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine

_SEED: Final = 17
_SIZES: Final = ((640, 480, 30), (800, 600, 30), (640, 360, 24), (848, 480, 30), (480, 640, 30))
_READOUT_MS: Final = 1.0
_STRETCHES: Final = 4
_MOST_STRETCHES: Final = 8
_LOOK_MS: Final = 3000.0


@dataclass(frozen=True, slots=True)
class Row:
    """One film.

    Attributes:
        name: what is filmed, and what was done to the film.
        truth: what the verdict should be.
        found: the verdict.
        excess: of a warp over noise, median.
        noise_px: scatter of followed points, px.
        windows: stretches that told something.
        readout_ms: estimated readout.
        readout_off_ms: its error.
        look_ms: CPU time of a look, mean.
    """

    name: str
    truth: str
    found: str
    excess: float
    noise_px: float
    windows: int
    readout_ms: float
    readout_off_ms: float
    look_ms: float


def takes(seed: int) -> list[Take]:
    """Return twenty stabilised films: each place with each stabiliser.

    Args:
        seed: of everything that is drawn.
    """
    random = np.random.default_rng([seed, 17])
    places = (Place.ROOM, Place.DESK, Place.SHELF, Place.FAR)
    kinds = [kind for kind in Stabiliser if kind is not Stabiliser.OFF]
    found = []
    for number, (place, kind) in enumerate(product(places, kinds)):
        width_px, height_px, fps = _SIZES[number % len(_SIZES)]
        take = Take(
            place=place,
            seed=int(random.integers(1 << 30)),
            width_px=width_px,
            height_px=height_px,
            fps=fps,
            view_deg=random.uniform(50, 75) * (0.75 if height_px > width_px else 1.0),
            k1=random.uniform(0.02, 0.12) * random.choice([-1, 1]),
            readout=random.uniform(0.2, 0.95) * fps / 30,
            seconds=(_MOST_STRETCHES * FRAMES + 1) / fps,
            sway_deg=random.uniform(2.0, 6.0),
            sway_hz=random.uniform(0.4, 1.1),
            tremor_deg=random.uniform(0.08, 0.4),
            slide_m=random.uniform(0.01, 0.06),
            stabiliser=kind,
            strength=random.uniform(0.3, 1.0),
            smooth_s=random.uniform(0.15, 0.5),
            noise=random.uniform(1.0, 3.0),
            jpeg=int(random.integers(70, 96)),
        )
        nuisance = number % 4
        if nuisance == 1:
            take = replace(take, walker=place is not Place.FAR)
        elif nuisance == 2:
            take = replace(take, exposure=0.3)
        elif nuisance == 3:
            take = replace(take, noise=6.0)
        found.append(take)
    return found


def _blind(seed: int) -> list[Take]:
    """Films that tell nothing."""
    still = Take(seed=seed, sway_deg=0.02, tremor_deg=0.005, slide_m=0.0002)
    return [
        Take(seed=seed, place=Place.PLAIN),
        Take(seed=seed, place=Place.POSTER, slide_m=0.05),
        still,
        replace(still, stabiliser=Stabiliser.TURN),
    ]


def _calibrated(take: Take) -> CameraModel:
    """The lens, off by what good calibrations are off."""
    random = np.random.default_rng([take.seed, 5])
    true = lens_of(take)
    matrix = true.matrix.copy()
    matrix[(0, 1), (0, 1)] *= 1 + random.normal(0, 0.003)
    matrix[:2, 2] += random.normal(0, 0.0025 * take.width_px, 2)
    distortion = true.distortion.copy()
    distortion[0] += random.normal(0, 0.003)
    return replace(true, matrix=matrix, distortion=distortion)


def watch(take: Take, *, knows_lens: bool = True) -> tuple[Rigidity, float]:
    """Check a film.

    Args:
        take: the film.
        knows_lens: whether the check is given the lens.

    Returns:
        What was found, and the mean CPU time of a look, ms.
    """
    source = CaptureSource(software="Chrome 141 on Android", width_px=take.width_px, height_px=take.height_px)
    plan = Plan(take.seconds + 1, 0.5 / take.fps, take.seconds + 1)
    check = CaptureCheck(source, take.fps, _calibrated(take) if knows_lens else None, plan)
    times_ms: list[float] = []
    for number, (t_s, image) in enumerate(film(take)):
        if number > _STRETCHES * FRAMES and check.report.rigidity.warping is not Warping.UNKNOWN:
            break
        window = check.add(image, round(t_s * 1e9), round(t_s * 1e9), None)
        if window is not None:
            began = time.process_time()
            check.take(look(window))
            times_ms.append(1e3 * (time.process_time() - began))
    return check.report.rigidity, float(np.mean(times_ms))


def _row(take: Take, truth: Warping, *, knows_lens: bool = True) -> Row:
    found, look_ms = watch(take, knows_lens=knows_lens)
    parts = [take.place.value, f"{take.width_px}x{take.height_px}", take.stabiliser.value]
    if take.stabiliser is not Stabiliser.OFF:
        parts.append(f"{take.strength:.2f}")
    parts += [word for word, is_so in (("walker", take.walker), ("exposure", take.exposure > 0)) if is_so]
    true_ms = 1e3 * take.readout / take.fps * 0.9
    return Row(
        " ".join(parts),
        truth.value,
        found.warping.value,
        found.excess,
        found.noise_px,
        found.windows,
        found.readout_ms,
        found.readout_ms - true_ms,
        look_ms,
    )


def pair_rows(take: Take) -> list[Row]:
    """Check a film without its stabiliser and with it."""
    plain = replace(take, stabiliser=Stabiliser.OFF)
    return [_row(plain, Warping.GOOD), _row(take, Warping.STABILISED)]


def guessed_rows(take: Take) -> list[Row]:
    """The same without a calibrated lens."""
    plain = replace(take, stabiliser=Stabiliser.OFF)
    return [_row(plain, Warping.GOOD, knows_lens=False), _row(take, Warping.STABILISED, knows_lens=False)]


def blind_row(take: Take) -> Row:
    """Check a film that tells nothing."""
    return _row(take, Warping.UNKNOWN)


def _verdicts(pairs: Sequence[Sequence[Row]], blind: Sequence[Row], guessed: Sequence[Sequence[Row]]) -> list[Verdict]:
    right = sum(all(row.found == row.truth for row in pair) for pair in pairs)
    wrong = sum(
        row.found not in {row.truth, Warping.UNKNOWN.value} for row in [*(row for pair in guessed for row in pair)]
    )
    told = sum(row.found == row.truth for row in _flat(guessed))
    accused = sum(row.found == Warping.STABILISED.value for pair in pairs for row in pair[:1])
    slowest_ms = max((row.look_ms for row in _flat(pairs)), default=0.0)
    seen = sum(row.found == row.truth for row in blind)
    off_ms = [abs(row.readout_off_ms) for pair in pairs for row in pair[:1] if row.found == row.truth]
    worst_ms = max(off_ms) if off_ms else 0.0
    return [
        Verdict("films with and without stabilisation told apart", right == len(pairs), f"{right} of {len(pairs)}", f"{len(pairs)} of {len(pairs)}"),
        Verdict("films that tell nothing: cannot tell", seen == len(blind), f"{seen} of {len(blind)}", f"{len(blind)} of {len(blind)}"),
        Verdict("rolling shutter, largest error", worst_ms <= _READOUT_MS, f"{worst_ms:.1f} ms", f"{_READOUT_MS:g} ms"),
        Verdict("rigid films called stabilised", accused == 0, str(accused), "none"),
        Verdict("CPU of a look, largest mean of a film", slowest_ms <= _LOOK_MS, f"{slowest_ms / 1e3:.1f} s", f"{_LOOK_MS / 1e3:g} s"),
        Verdict("lens not calibrated: wrong verdicts", wrong == 0, f"{wrong} of {2 * len(guessed)}, {told} right", "none"),
    ]  # fmt: skip


def main() -> int:
    """Run everything, print the table, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=20, help="how many films, each with and without (figure: 20)")
    parser.add_argument("--guessed", type=int, default=4, help="how many of them also without a calibrated lens")
    parser.add_argument("--seed", type=int, default=_SEED, help="of everything that is drawn (default: %(default)s)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    drawn = takes(options.seed)[: options.pairs]
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=spawn, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        pairs = pool.map(pair_rows, drawn)
        blind = pool.map(blind_row, _blind(options.seed))
        guessed = pool.map(guessed_rows, drawn[:: max(1, len(drawn) // max(options.guessed, 1))][: options.guessed])
        told, unseen, without = list(pairs), list(blind), list(guessed)
    verdicts = _verdicts(told, unseen, without)
    if options.json:
        tables: dict[str, Sequence[Row | Verdict]] = {
            "pairs": _flat(told),
            "blind": unseen,
            "guessed": _flat(without),
            "verdicts": verdicts,
        }
        shown = {name: [asdict(row) for row in rows] for name, rows in tables.items()}
        print(json.dumps({"machine": str(machine()), **shown}))
        return exit_code(verdicts)
    console = Console(width=150)
    console.print(machine())
    for title, rows in (
        ("calibrated lens", _flat(told)),
        ("nothing to see", unseen),
        ("lens not calibrated", _flat(without)),
    ):
        console.print(_table(title, rows))
    for verdict in verdicts:
        console.print(str(verdict))
    return exit_code(verdicts)


def _flat(pairs: Sequence[Sequence[Row]]) -> list[Row]:
    return [row for pair in pairs for row in pair]


def _table(title: str, rows: Sequence[Row]) -> Table:
    table = Table(title=title)
    for name in ("film", "verdict", "excess", "noise, px", "windows", "readout, ms (error)", "CPU of a look, ms"):
        table.add_column(name)
    for row in rows:
        verdict = row.found if row.found == row.truth else f"{row.found} (NOT {row.truth})"
        readout = f"{row.readout_ms:.1f} ({row.readout_off_ms:+.1f})"
        table.add_row(
            row.name,
            verdict,
            f"{row.excess:.2f}",
            f"{row.noise_px:.3f}",
            str(row.windows),
            readout,
            f"{row.look_ms:.0f}",
        )
    return table


if __name__ == "__main__":
    sys.exit(main())
