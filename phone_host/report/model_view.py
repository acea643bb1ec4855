"""The part of a page that shows a scan's surface, to be turned: the viewer of the live page draws it. Pure.

It holds a coarser mesh if the whole one would make the page heavy; model.ply has the whole one.
"""

import json
import math
from dataclasses import dataclass
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.words import two_digits
from phone_host.output.axes import Axes
from phone_host.report.depth_data import text_of
from phone_host.report.depth_view import THIN
from phone_host.scan.mesh import Mesh, thinned

MOST_TRIANGLES: Final = 150_000
"""Of a mesh in a page: some 4 MB of text."""

_STEPS: Final = 65535


@dataclass(frozen=True, slots=True, eq=False)
class ShownModel:
    """A surface for the page.

    Attributes:
        mesh: its triangles.
        noise_m: (V,) standard deviation of its points, m.
        voxel_m: of the field that it was made of, m.
        upright: its axes, if z is up in them; None: they are a camera's.
        seen: (V,) whether some view measured its points; the others are hatched. None: all are seen.
    """

    mesh: Mesh
    noise_m: NDArray[np.float32]
    voxel_m: float
    upright: Axes | None = None
    seen: NDArray[np.bool_] | None = None


def model_view(shown: ShownModel, file: str) -> str:
    """Make the model that can be turned: HTML; empty if there is no triangle."""
    total = len(shown.mesh.triangles)
    if not total:
        return ""
    mesh, stands_for = thinned(shown.mesh, MOST_TRIANGLES, shown.voxel_m)
    seen = np.ones(len(stands_for), np.bool_) if shown.seen is None else shown.seen[stands_for]
    noise_m = np.nan_to_num(shown.noise_m[stands_for], nan=np.inf)
    known_m = shown.noise_m[np.isfinite(shown.noise_m)]  # none, where each point was seen once
    best, worst = np.percentile(known_m, (2, 98)).tolist() if len(known_m) else (math.nan, math.nan)
    worst = max(worst, best * 1.01)
    low = mesh.points_m.min(axis=0)
    size = mesh.points_m.max(axis=0) - low
    step = float(size.max()) / _STEPS
    view = {
        "low": low.tolist(),
        "size": size.tolist(),
        "step": step,
        "axes": "camera" if shown.upright is None else "mat",
    }
    points = np.rint((mesh.points_m - low) / step).astype(np.uint16)
    levels = np.clip((noise_m - best) / (worst - best), 0, 1) * 255 if len(known_m) else np.full(len(noise_m), 255.0)
    data = {
        "points": text_of(points),
        "triangles": text_of(mesh.triangles.astype(np.uint32)),
        "colours": text_of(mesh.colours),
        "noise": text_of(np.rint(levels).astype(np.uint8)),
        "seen": text_of(seen.astype(np.uint8)),
    }
    held = "".join(f' data-{name}="{text}"' for name, text in data.items())
    return (
        f'<div class="clouds modelview" data-mesh="{escape(json.dumps(view))}"{held}><figure><div class="turn">'
        '<canvas tabindex="0" role="application" aria-label="the model; arrow keys turn it, plus and minus zoom, Home goes back"></canvas>'
        '<canvas aria-hidden="true"></canvas>'
        f'<p class="nocloud" hidden>This browser cannot draw the model (no WebGL 2); {escape(file)} holds it.</p></div>'
        f"<figcaption>{escape(_words(len(mesh.triangles), total, shown))}</figcaption></figure>"
        f'<div class="buttons">{_buttons(shown)}</div><div class="buttons">{_paints(best, worst)}</div>'
        f"<noscript><p>The model needs a browser that runs the script in this page; {escape(file)} holds it.</p></noscript></div>"
    )


def _buttons(model: ShownModel) -> str:
    front = "as the camera began" if model.upright is None else "front"
    views = (("turned", "turned"), ("front", front), ("side", "side"), ("above", "above"))
    return "".join(f'<button type="button" data-to="{name}">{words}</button>' for name, words in views)


def _paints(best_m: float, worst_m: float) -> str:
    known = f"how exactly it is known: bright \u00b1 {two_digits(best_m * 1e3)} mm, dark \u00b1 {two_digits(worst_m * 1e3)} mm"
    told = (("noise", known),) if math.isfinite(best_m) else ()
    choices = (("colour", "colours"), ("shape", "shape alone"), *told)
    return "".join(
        f'<label class="check"><input type="radio" name="paint" data-paint="{name}"{" checked" if name == "colour" else ""}> {words}</label>'
        for name, words in choices
    )


def _words(shown: int, total: int, model: ShownModel) -> str:
    number = f"{shown:,} triangles stand for {total:,}" if shown < total else f"{total:,} triangles"
    axes = (
        f"the {model.upright.value}'s: Z up"
        if model.upright
        else "the left camera's at the first pair: X right, Y down, Z forward"
    )
    hatched = (
        "" if model.seen is None or model.seen.all() else " Hatched surface was never in view: its shape is a guess."
    )
    return (
        f"{number.replace(',', THIN)}; the axes are {axes}. Drag turns, two fingers"
        " or the wheel (after a click) zoom, shift and drag move, a double click goes back. Dark is the surface seen from behind."
        f"{hatched}"
    )
