"""Whether places of one scene are taken for another: `python -m tests.bench.bench_scan_places [--pairs N] [--json]`.

Views of $SCAN_DATA (a room, a street, a rig at rest) and of rendered corners with twelve pictures. A view is compared with a place of another scene,
drawn at random, N times (default 10000). told: features that agree are enough. A loop needs the surface to fit as well, so what is told here
is an upper bound. Exit 4 when any pair is told, 3 when there is no SCAN_DATA.
"""

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.progress import track

from phone_host.geometry.se3 import SE3
from phone_host.scan.places import Places
from phone_host.scan.view import View
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.scan_clips import at_rest, room, street
from tests.support.plane_films import CORNER, path, plane_view, texture

_PICTURES: Final = 12
_STEP: Final = np.array([0.02, 0.05, -0.02, 0.03, -0.02, 0.02])


def scenes(data: Path) -> list[tuple[View, ...]]:
    """Views of scenes, none of which shows another."""
    rendered = [
        tuple(plane_view(pose, texture(100 + seed), CORNER) for pose in path(6, _STEP)) for seed in range(_PICTURES)
    ]
    return [room(data).views[::2], street(data).left.views, at_rest(data).views[::4], *rendered]


def main() -> int:
    """Run and print; exit code 3 when there are no sequences, 4 when a pair is told."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_scan_places", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--pairs", type=int, default=10_000, help="that are compared (default 10000)")
    options = parser.parse_args()
    if not os.environ.get("SCAN_DATA"):
        print("bench_scan_places was not run: SCAN_DATA does not name the folder of real images", file=sys.stderr)
        return 3
    cv2.setNumThreads(1)
    every, random = scenes(Path(os.environ["SCAN_DATA"])), np.random.default_rng(1)
    remembered = []
    for views in every:
        remembered.append([Places() for _ in views])
        for places, view in zip(remembered[-1], views, strict=True):
            places.remember(view, SE3.identity())
    told, console = 0, Console(stderr=True)
    for _ in track(range(options.pairs), "comparing", console=console, disable=not console.is_terminal):
        here, there = random.choice(len(every), 2, replace=False).tolist()
        view = every[here][int(random.integers(len(every[here])))]
        place = remembered[there][int(random.integers(len(remembered[there])))]
        told += place.recognised(view) is not None
    verdicts = [
        Verdict(f"places of other scenes told in {options.pairs} pairs", told == 0, f"{told}", "0"),
    ]
    if options.json:
        print(json.dumps({"machine": str(machine()), "told": told, "pairs": options.pairs}))
    else:
        print(machine())
        print(*verdicts, sep="\n")
    return exit_code(verdicts)


if __name__ == "__main__":
    sys.exit(main())
