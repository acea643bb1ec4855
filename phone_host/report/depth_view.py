"""The parts of a page that show depth: both views with row lines, disparity and depth with scales, a cloud that can be turned. Pure.

Without the page's script (`page_script`) they are plain pictures. The cloud is drawn from the grid of disparities and the left picture.
"""

import base64
import json
import math
from collections.abc import Sequence
from html import escape
from typing import Final

import cv2
import numpy as np

from phone_host.model import Processed
from phone_host.output.preview import colour_disparity, colour_range_px, depth_range_m
from phone_host.report import depth_data
from phone_host.report.depth_data import Grid
from phone_host.svg.plot_scale import ticks

STYLE: Final = """
.views{display:grid;grid-template-columns:1fr 1fr;gap:.75rem}.views figure{margin:0;min-width:0}
.views.rows{gap:2px}.views.stack{grid-template-columns:1fr;max-width:640px;gap:2px}
.view{position:relative;line-height:0;background:#000;touch-action:pan-y;cursor:crosshair}.view.still{cursor:default}
.view img{width:100%;height:auto;display:block}
.view i{position:absolute;width:17px;height:17px;margin:-9px 0 0 -9px;border:2px solid #fff;border-radius:50%;
box-shadow:0 0 0 1.5px #000,inset 0 0 0 1.5px #000;pointer-events:none}.view i[hidden]{display:none}
.lines{position:absolute;inset:0;pointer-events:none}
.rows .lines{background:repeating-linear-gradient(to bottom,transparent 0 calc(10% - 1px),#ff5a4fb0 calc(10% - 1px) 10%)}
.stack .lines{background:repeating-linear-gradient(to right,transparent 0 calc(10% - 1px),#ff5a4fb0 calc(10% - 1px) 10%)}
.depthview:has(.withlines:not(:checked)) .lines{display:none}
.views figcaption,.clouds figcaption{font-size:.85rem;color:var(--ink2);margin:.35rem 0 .25rem;line-height:1.4;overflow-wrap:anywhere}
.readout{position:sticky;top:0;z-index:1;display:block;background:var(--card);padding:.4rem 0;min-height:2.3rem;
font-variant-numeric:tabular-nums;font-weight:600}
.check{font-size:.85rem;color:var(--ink2);display:block;margin:.4rem 0 .8rem}
.bar{height:.7rem;border-radius:3px;margin-top:.4rem}
.ticks{position:relative;height:1.5rem;font-size:.75rem;color:var(--ink2);font-variant-numeric:tabular-nums;line-height:1}
.ticks span{position:absolute;transform:translateX(-50%);white-space:nowrap;padding-top:6px}
.ticks span::before{content:"";position:absolute;left:50%;top:0;height:4px;border-left:1px solid var(--ink2)}
.views+.clouds,.depthview+.clouds{margin-top:1.25rem}.clouds figure{margin:0}
.clouds .turn{position:relative;height:min(62vh,560px);background:#12161c;border-radius:8px;overflow:hidden}
.clouds canvas{position:absolute;inset:0;width:100%;height:100%;touch-action:none;cursor:grab;border-radius:8px}
.clouds canvas+canvas{pointer-events:none;color:#c9d1d9;--ground:#12161c}
.nocloud{position:absolute;inset:0;margin:0;padding:1rem;display:grid;place-items:center;color:#c9d1d9}.nocloud[hidden]{display:none}
.clouds canvas:active{cursor:grabbing}.clouds canvas:focus-visible{outline:2px solid var(--c5);outline-offset:-2px}.view:focus-visible{outline:2px solid var(--c5);outline-offset:2px}
button{font:inherit;font-size:.85rem;color:var(--ink);background:var(--bg);border:1px solid var(--line);border-radius:6px;padding:.35rem .8rem;cursor:pointer}
.buttons{display:flex;flex-wrap:wrap;gap:.5rem;margin:.6rem 0 0}
@media (max-width:700px){.views.maps{grid-template-columns:1fr}.clouds .turn{height:min(56vh,120vw)}.readout{font-size:.9rem}}
"""

THIN: Final = "\u202f"
"""The space between groups of three digits."""

_RAMP_STEPS: Final = 12
_MOST_TICKS: Final = 6


def depth_view(processed: Processed, captions: tuple[str, str]) -> str:
    """Make the four pictures of a pair. The script shows the depth at the pointer, and the same point in all four.

    Args:
        processed: a pair with its disparity.
        captions: what the left and right pictures are, plain text.

    Returns:
        HTML.
    """
    assert processed.disparity is not None
    small = depth_data.grid(processed.disparity, processed.cloud if processed.geometry is not None else None)
    stacked = processed.pair.epipolar.is_vertical
    kind = "stack" if stacked else "rows"
    views = "".join(
        _figure(depth_data.photograph(image), caption, side, lines=True)
        for image, caption, side in (
            (processed.pair.left, captions[0], "left"),
            (processed.pair.right, captions[1], "right"),
        )
    )
    words = "column" if stacked else "row"
    return (
        f'<div class="depthview" data-view="{escape(json.dumps(_view(processed, small)))}" '
        f'data-grid="{depth_data.text_of(small.cells)}">'
        f'<output class="readout">{escape(_hint(processed))}</output>'
        f'<div class="views {kind}">{views}</div>'
        f'<label class="check"><input type="checkbox" class="withlines" checked> {words} lines: '
        f"a point lies on the same {words} in both pictures</label>"
        f'<div class="views maps">{_disparity_figure(processed)}{_depth_figure(processed)}</div></div>'
    )


def cloud_view(processed: Processed) -> str:
    """Make the cloud that can be turned: HTML; empty if there is no point."""
    if processed.cloud is None or processed.geometry is None:
        return ""
    assert processed.disparity is not None
    total = int(np.isfinite(processed.cloud[..., 2]).sum())
    if not total:
        return ""
    shown = depth_data.grid(processed.disparity, processed.cloud).points
    buttons = "".join(
        f'<button type="button" data-to="{name}">{words}</button>'
        for name, words in (
            ("turned", "turned"),
            ("front", "as the camera sees it"),
            ("side", "side"),
            ("above", "above"),
        )
    )
    return (
        '<div class="clouds cloudview"><figure><div class="turn">'
        '<canvas tabindex="0" role="application" aria-label="the point cloud; arrow keys turn it, plus and minus zoom, Home goes back"></canvas>'
        '<canvas aria-hidden="true"></canvas>'
        '<p class="nocloud" hidden>This browser cannot draw the cloud (no WebGL 2); cloud.ply holds it.</p></div>'
        f"<figcaption>{escape(_cloud_words(shown, total))}</figcaption></figure>"
        f'<div class="buttons">{buttons}</div>'
        "<noscript><p>The cloud needs a browser that runs the script in this page.</p></noscript></div>"
    )


def _view(processed: Processed, small: Grid) -> dict[str, object]:
    """Return what the script needs to know, as a JSON object."""
    assert processed.disparity is not None
    height, width = processed.pair.left.shape[:2]
    geometry, limits = processed.geometry, processed.limits
    rows, columns = small.cells.shape
    values: dict[str, object] = {
        "width": width,
        "height": height,
        "rows": rows,
        "columns": columns,
        "step": small.step_px,
        "low": small.low_px,
        "high": small.high_px,
        "range": colour_range_px(processed.disparity),
        "way": processed.pair.epipolar.way,
    }
    if geometry is not None and processed.cloud is not None:
        values |= {
            "focal": geometry.focal_px,
            "baseline": geometry.baseline_m,
            "doffs": geometry.doffs_px,
            "cx": geometry.cx_px,
            "cy": geometry.cy_px,
            "error": limits.disparity_error_px if limits is not None else 0.0,
        }
    return values


def _hint(processed: Processed) -> str:
    if processed.geometry is None or processed.cloud is None:
        return "Point at a picture: its disparity. No metres: focal length and baseline are not known."
    return "Point at the left picture, disparity or depth: metres."


def _cloud_words(shown: int, total: int) -> str:
    number = f"{shown:,} of {total:,} points" if shown < total else f"{total:,} {'point' if total == 1 else 'points'}"
    return (
        f"{number.replace(',', THIN)}, metres; drawn in the left camera's axes: X right, Y down, Z forward. Drag turns, two fingers or the wheel "
        "(after a click) zoom, shift and drag move, a double click goes back."
    )


def _figure(data: bytes, caption: str, side: str, *, lines: bool = False, below: str = "") -> str:
    """Make one picture; all but the right one are read by a pointer."""
    form = "jpeg" if data.startswith(b"\xff\xd8") else "png"
    kind, key = ("view still", "") if side == "right" else ("view", ' tabindex="0"')
    over = '<div class="lines"></div>' if lines else ""
    return (
        f'<figure><div class="{kind}" data-side="{side}"{key}><img alt="{escape(caption)}" '
        f'src="data:image/{form};base64,{base64.b64encode(data).decode("ascii")}">{over}<i hidden></i></div>'
        f"{below}<figcaption>{escape(caption)}</figcaption></figure>"
    )


def _disparity_figure(processed: Processed) -> str:
    assert processed.disparity is not None
    low, high = colour_range_px(processed.disparity)
    picture = colour_disparity(depth_data.reduced(processed.disparity), low, high)
    geometry = processed.geometry
    marks = [(value, f"{value:g} px") for value in ticks(low, high, 4) if low <= value <= high]
    caption = "disparity, px: bright is near, black is none"
    if geometry is not None and low + geometry.doffs_px > 0:
        product = geometry.focal_px * geometry.baseline_m
        near, far = product / (high + geometry.doffs_px), product / (low + geometry.doffs_px)
        marks = [(product / z - geometry.doffs_px, f"{z:g} m") for z in _round_depths(near, far)]
        caption = f"disparity, {low:.1f} to {high:.1f} px: bright is near, black is none; the scale is in metres"
    places = [((value - low) / (high - low), words) for value, words in marks]
    below = _scale(places) if np.isfinite(processed.disparity).any() else ""
    return _figure(depth_data.drawing(picture), caption, "left", below=below)


def _depth_figure(processed: Processed) -> str:
    if processed.cloud is None or processed.geometry is None:
        return ""
    depth = processed.cloud[..., 2]
    near, far = depth_range_m(depth)
    picture = depth_data.depth_picture(depth, near, far)
    span = math.log(far / near)
    places = [(math.log(far / z) / span, f"{z:g} m") for z in _round_depths(near, far)]
    caption = "depth Z, metres along the left camera's axis: bright is near, black is none or cut"
    below = _scale(places) if np.isfinite(depth).any() else ""
    return _figure(depth_data.drawing(picture), caption, "left", below=below)


def _round_depths(near_m: float, far_m: float) -> list[float]:
    """Choose round depths between two, evenly in the ratio if they are far apart."""
    if far_m < 4.0 * near_m:
        return [round(z, 9) for z in ticks(near_m, far_m, 6) if near_m <= z <= far_m]
    found: list[float] = []
    powers = range(math.floor(math.log10(near_m)), math.ceil(math.log10(far_m)) + 1)
    for factors in ((1, 1.5, 2, 3, 5, 7), (1, 2, 5), (1, 3), (1,)):
        found = [float(f"{factor * 10.0**power:.3g}") for power in powers for factor in factors]
        found = [z for z in found if near_m <= z <= far_m]
        if len(found) <= _MOST_TICKS:
            break
    return found


def _scale(places: Sequence[tuple[float, str]]) -> str:
    """Draw a bar in the colours of the pictures, dark to bright, with marks at shares of its length."""
    levels = np.linspace(0, 255, _RAMP_STEPS).astype(np.uint8)[None]
    blue_green_red = np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS))[0]
    colours = ",".join(f"#{red:02x}{green:02x}{blue:02x}" for blue, green, red in blue_green_red.tolist())
    # Two labels that touch say less than one. A label takes about a seventh of a phone's picture.
    marks, taken = "", -1.0
    for place, words in sorted(places):
        if place - taken >= 0.14 and 0.03 <= place <= 0.97:
            marks, taken = f'{marks}<span style="left:{100 * place:.1f}%">{escape(words)}</span>', place
    return f'<div class="bar" style="background:linear-gradient(to right,{colours})"></div><div class="ticks">{marks}</div>'
