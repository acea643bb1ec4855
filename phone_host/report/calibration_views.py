"""The cards of a calibration's page that show views: what they cover, what is left of their corners, their order, their pictures. Pure."""

import math
from functools import partial
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.words import counted
from phone_host.model.calibration_series import CalibrationSeries, RectifiedView, SeenBoard, SeriesView, Size
from phone_host.report.page_frame import HALF_PX, section, table, two_widths
from phone_host.report.report_page import Picture, picture_uri
from phone_host.svg.plot_arrows import Enlarged, SeenErrors, arrow_field, enlarged, photo_arrows
from phone_host.svg.plot_maps import TiltedBoard, coverage_map, tile_views, tilt_disc
from phone_host.svg.plot_marks import Course, Mark, over_distance, over_views
from phone_host.svg.plot_parts import legend, svg

Floats = NDArray[np.float64]

_MOST_PICTURES: Final = 30  # views; each takes 25 KB of the page
_MOST_SHOWN: Final = 6
"""So many pictures of the worst views are shown at once; the others open on demand."""

_PICTURE_PX: Final = 340
_ARROW_SHARE: Final = 0.06
_FIELD_SHARE: Final = 0.055
_FIELD_TILES: Final = 14
_LEAST_IN_TILE: Final = 3
_EMPTY: Final = 0.6
"""A third of the image of whose tiles more than this share is empty counts as empty."""

_FIGURES: Final = (
    "Errors are RMS. Then the board as the rig sees it in space: by how many standard deviations the rays of left and right miss each other"
    " (1 is noise), how large it is, and how far its middle stands out. A view whose rays miss was not taken at one moment; one whose board"
    " is larger or smaller than the others contradicts them in depth; a board that is bent in all views alike is not flat."
)
_95_PERCENT: Final = 1.96
_LINES: Final = 7
_TURNS: Final = (("about x (up and down: rows)", 4), ("about y (left and right: depth)", 5), ("about z (roll)", 2))


def coverage_card(series: CalibrationSeries) -> str:
    """Make the card that shows where in the images, how far and how tilted boards were seen."""
    used = [view for view in series.views if view.is_used] or [v for v in series.views if len(v.left.corners_px)]
    if not used:
        return ""
    sides = "".join(
        _coverage(name, [getattr(view, name).corners_px for view in used], size)
        for name, size in zip(("left", "right"), series.sizes_px, strict=True)
    )
    content = f'<div class="pair">{sides}</div>'
    placed = [view for view in used if len(view.outline_m)]
    if placed:
        content += f'<div class="pair">{_distances(placed)}</div>'
    words = (
        "Each dot is a corner that was seen; the darker a tile, the more views reach it; crossed-out tiles have none. Lenses"
        " bend most at the edges, and what no board has shown there is extrapolated."
    )
    return section("What the views cover", words, content)


def _coverage(name: str, corners: list[Floats], size: Size) -> str:
    counts = tile_views(corners, size)
    drawn = two_widths(partial(coverage_map, corners, size, counts, f"corners seen in the {name} image"), HALF_PX)
    return f'<div><h3>{name} camera</h3>{drawn}<p class="sub">{escape(_empty_words(counts))}</p></div>'


def _empty_words(counts: NDArray[np.int64]) -> str:
    """Say how much of the image has corners, and which of its ninths have hardly any."""
    words = f"{np.mean(counts > 0):.0%} of the image has corners"
    empty = [
        " ".join(filter(None, (row_name, column_name))) or "the middle"
        for row_name, rows in zip(("top", "", "bottom"), np.array_split(counts, 3), strict=True)
        for column_name, tiles in zip(("left", "", "right"), np.array_split(rows, 3, axis=1), strict=True)
        if np.mean(tiles == 0) > _EMPTY
    ]
    return f"{words}; hardly any: {', '.join(empty)}" if empty else words


def _distances(views: list[SeriesView]) -> str:
    marks, tilts = [], []
    for view in views:
        normal = np.cross(view.outline_m[1] - view.outline_m[0], view.outline_m[3] - view.outline_m[0])
        normal *= -np.sign(normal[2]) / np.linalg.norm(normal)
        angle = math.degrees(math.acos(min(1.0, abs(float(normal[2])))))
        away_m = float(np.linalg.norm(view.outline_m.mean(axis=0)))
        title = f"{view.name}: {away_m:.2f} m away, tilted by {angle:.0f}°"
        marks.append(Mark(away_m, angle, title))
        tilts.append(TiltedBoard(angle, float(normal[0]), float(normal[1]), title))
    far = two_widths(partial(over_distance, marks, [], "tilt, °", "tilt of the boards over their distance"), HALF_PX)
    way = two_widths(partial(tilt_disc, tilts, "which way the boards were tilted"), HALF_PX)
    words = "Each dot is a board, seen from the left camera. The middle faces the camera; 20° to 45° in all directions teach most."
    return f'<div><h3>Distance and tilt</h3>{far}</div><div><h3>Which way boards faced</h3>{way}<p class="sub">{words}</p></div>'


def rectified_card(series: CalibrationSeries) -> str:
    """Make the card with a rectified pair and row lines."""
    shown = series.rectified
    if shown is None:
        return ""
    rows = "column" if shown.is_vertical else "row"
    words = (
        f"Pair {shown.name} as a matcher sees it. Each line runs through a corner in the left image; the same corner of the right"
        f" image has to lie on it, because a matcher only looks along the {rows}."
    )
    return section("Rectified pair", words, _rectified(shown))


def _rectified(shown: RectifiedView) -> str:
    width, height = shown.size_px
    gap = max(2.0, 0.006 * max(width, height))
    step = np.array([0.0, height + gap]) if shown.is_vertical else np.array([width + gap, 0.0])
    whole_w, whole_h = width + step[0], height + step[1]
    parts = []
    for data, at in ((shown.left, np.zeros(2)), (shown.right, step)):
        uri = picture_uri(Picture("rectified", data))
        parts.append(
            f'<image href="{uri}" x="{at[0]:.1f}" y="{at[1]:.1f}" width="{width}" height="{height}" preserveAspectRatio="none"/>'
        )
    axis = 0 if shown.is_vertical else 1
    rows = shown.left_px[:, axis]
    wanted = np.linspace(rows.min(), rows.max(), _LINES)
    chosen = np.unique(np.abs(rows - wanted[:, np.newaxis]).argmin(axis=1))
    radius = 0.006 * max(whole_w, whole_h)
    for number, index in enumerate(chosen):
        left, right = shown.left_px[index] + 0.5, shown.right_px[index] + 0.5 + step
        line = f"M{left[0]:.1f} 0V{whole_h:.1f}" if shown.is_vertical else f"M0 {left[1]:.1f}H{whole_w:.1f}"
        look = f"stroke:var(--c{number});stroke-width:1.6;fill:none;vector-effect:non-scaling-stroke"
        rings = "".join(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" style="{look}"/>' for x, y in (left, right)
        )
        parts.append(f'<path d="{line}" style="{look}"/>{rings}')
    return svg(round(whole_w), whole_h, "left and right image after rectification, with lines", parts)


def views_card(series: CalibrationSeries) -> str:
    """Make the card with the pictures of the used views, the worst ones first."""
    used = [view for view in series.views if view.is_used]
    if not used:
        return ""
    scale = _scale(used, _ARROW_SHARE)
    worst = sorted(used, key=lambda view: -_rms_px(view))
    times = _times(scale, series)
    words = (
        f"Arrows lead from where the rig expects a corner to where it was seen{times}; the bar shows their scale. The worst views"
        " come first. Arrows that all point one way: the board or a camera moved; arrows at one end: blur, glare or a board that is"
        " not flat."
    )
    content = _pictures(worst[:_MOST_PICTURES], series, scale)
    rows = [
        (view.name, f"{_one_rms(view.left):.3f}", f"{_one_rms(view.right):.3f}", _vertical(view), *_in_space(view))
        for view in used
    ]
    numbers = table(
        ("pair", "left, px", "right, px", "vertical, px", "rays miss, \u03c3", "board\u2019s size, %", "its bow, mm"),
        rows,
    )
    content += f'<details><summary>Figures of all views</summary><p class="sub">{_FIGURES}</p>{numbers}</details>'
    return section("What is left in each view", words, content)


def rejected_card(series: CalibrationSeries) -> str:
    """Make the card with the views that are not used, and why."""
    out = [view for view in series.views if not view.is_used]
    if not out:
        return ""
    scale = Enlarged(1.0, 1.0)
    seen = [view for view in out if view.left.picture or view.right.picture][:_MOST_PICTURES]
    unseen = [view for view in out if view not in seen]
    content = _pictures(seen, series, scale) if seen else ""
    if unseen:
        content += table(("pair", "why"), [(view.name, _why(view)) for view in unseen])
    return section(f"Not used: {counted(len(out), 'pair')}", "Dots are corners that were found.", content)


def _pictures(shown: list[SeriesView], series: CalibrationSeries, scale: Enlarged) -> str:
    """Show the first views; the others on demand."""
    first, more = (
        f'<div class="views2">{"".join(_view(view, series, scale) for view in views)}</div>'
        for views in (shown[:_MOST_SHOWN], shown[_MOST_SHOWN:])
    )
    if len(shown) <= _MOST_SHOWN:
        return first
    rest = counted(len(shown) - _MOST_SHOWN, "more view", "more views")
    return f"{first}<details><summary>{rest}</summary>{more}</details>"


def _view(view: SeriesView, series: CalibrationSeries, scale: Enlarged) -> str:
    pictures = "".join(
        _photo(board, size, scale, f"{view.name}, {side}")
        for board, size, side in zip((view.left, view.right), series.sizes_px, ("left", "right"), strict=True)
    )
    if view.is_used:
        vertical = f", vertical {_vertical(view)}" if len(view.vertical_px) else ""
        said = f"left {_one_rms(view.left):.3f}, right {_one_rms(view.right):.3f}{vertical} px RMS"
    else:
        said = _why(view)
    return f'<figure><div class="both">{pictures}</div><figcaption><b>{escape(view.name)}</b>: {escape(said)}</figcaption></figure>'


def _photo(board: SeenBoard, size: Size, scale: Enlarged, label: str) -> str:
    uri = picture_uri(Picture(label, board.picture)) if board.picture else ""
    return photo_arrows(
        SeenErrors(size_px=size, places=board.corners_px, errors_px=board.residuals_px, picture=uri),
        scale,
        label,
        _PICTURE_PX,
    )


def _why(view: SeriesView) -> str:
    return f"{view.reason}: {view.detail}" if view.detail else view.reason


def field_card(series: CalibrationSeries) -> str:
    """Make the card with the mean errors over each image."""
    used = [view for view in series.views if view.is_used]
    if not used:
        return ""
    fields = [
        _field([getattr(view, side) for view in used], size)
        for side, size in zip(("left", "right"), series.sizes_px, strict=True)
    ]
    every = np.concatenate([errors for _, errors in fields])
    if not len(every):
        return ""
    scale, drawn = enlarged(every, _FIELD_SHARE), ""
    for name, (places, errors), size in zip(("left", "right"), fields, series.sizes_px, strict=True):
        seen = SeenErrors(size_px=size, places=places, errors_px=errors)
        draw = partial(arrow_field, seen, scale, f"mean residuals of the {name} image")
        title = f"{name} camera, {scale.words(size[0])}"
        drawn += f"<div><h3>{title}</h3>{two_widths(draw, HALF_PX)}</div>"
    words = (
        "Mean of the residuals of all views, tile by tile. A good lens model leaves short arrows without order; arrows that turn"
        " or grow towards the corners are what the lens model does not hold."
    )
    return section("What is left over the image", words, f'<div class="pair">{drawn}</div>')


def _field(boards: list[SeenBoard], size: Size) -> tuple[Floats, Floats]:
    """Return places and mean residuals, (K, 2) px each, of the tiles that have enough corners."""
    corners = np.concatenate([board.corners_px for board in boards])
    errors = np.concatenate([board.residuals_px for board in boards])
    known = np.isfinite(corners).all(axis=1) & np.isfinite(errors).all(axis=1)
    corners, errors = corners[known], errors[known]
    tile_px = size[0] / _FIELD_TILES
    tiles = np.floor((corners + 0.5) / tile_px).astype(np.int64)
    _, inverse, counts = np.unique(tiles, axis=0, return_inverse=True, return_counts=True)
    inverse = inverse.ravel()
    sums = [np.bincount(inverse, values, len(counts)) for values in (*corners.T, *errors.T)]
    means = np.column_stack(sums) / counts[:, np.newaxis]
    means = means[counts >= _LEAST_IN_TILE]
    return means[:, :2], means[:, 2:]


def course_card(series: CalibrationSeries) -> str:
    """Make the card with vertical error and relative rotation over the order of the views."""
    used = [view for view in series.views if view.is_used and len(view.as_seen_px)]
    turns = series.turns
    content = ""
    if len(used) > 1:
        means = np.array([view.as_seen_px.mean() for view in used])
        limits = np.array([_95_PERCENT * view.as_seen_px.std() / math.sqrt(len(view.as_seen_px)) for view in used])
        course = Course("vertical error", 5, means, limits)
        names = [view.name for view in used]
        draw = partial(over_views, names, [course], "px", "mean vertical error of each view")
        content += f"<h3>Mean vertical error, left minus right</h3>{two_widths(draw)}"
    if turns is not None:
        degrees, sigmas = np.degrees(turns.turns_rad), np.degrees(turns.sigmas_rad)
        courses = [
            Course(label, colour, degrees[:, axis], _95_PERCENT * sigmas[:, axis])
            for axis, (label, colour) in enumerate(_TURNS)
        ]
        draw = partial(over_views, turns.names, courses, "degrees", "turn of the right camera in each view")
        content += f"<h3>Turn of the right camera against the rig</h3>{legend(list(_TURNS))}{two_widths(draw)}"
    if not content:
        return ""
    words = (
        "Views in the order in which they were taken. A rig that is stiff scatters about 0; a trend or a step means that the"
        " cameras turned against each other. Bars hold 95 % by the noise of the corners."
    )
    if series.is_straightened:
        words += " The trend shown here was taken out before the rig was computed: it stands as in the last view."
    return section("Over the order of the views", words, content)


def _scale(views: list[SeriesView], share: float) -> Enlarged:
    return enlarged(np.concatenate([board.residuals_px for view in views for board in (view.left, view.right)]), share)


def _times(scale: Enlarged, series: CalibrationSeries) -> str:
    left, right = (scale.words(size[0]) for size in series.sizes_px)
    return f", {left}" if left == right else f", {left} left and {right} right"


def _one_rms(board: SeenBoard) -> float:
    errors = board.residuals_px[np.isfinite(board.residuals_px).all(axis=1)]
    return float(np.sqrt((errors**2).sum(axis=1).mean())) if len(errors) else math.nan


def _rms_px(view: SeriesView) -> float:
    both = [rms for rms in (_one_rms(view.left), _one_rms(view.right)) if math.isfinite(rms)]
    return max(both, default=0.0)


def _vertical(view: SeriesView) -> str:
    return f"{np.sqrt((view.vertical_px**2).mean()):.3f}" if len(view.vertical_px) else "\u2013"


def _in_space(view: SeriesView) -> tuple[str, str, str]:
    board = view.in_space
    if board is None or not math.isfinite(board.size):
        return "\u2013", "\u2013", "\u2013"
    bow_m, sigma_m = board.bow_m
    return (
        f"{board.miss:.2f}",
        f"{board.size * 100:.2f} \u00b1 {board.size_sigma * 100:.2f}",
        f"{bow_m * 1e3:+.2f} \u00b1 {sigma_m * 1e3:.2f}",
    )
