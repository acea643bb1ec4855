"""What a scan has come to, from files or live: its report, and what must be said of it."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from common.diagnostic import Diagnostic, Severity
from common.errors import DataError
from common.words import counted, distance_text, two_digits
from phone_host.model import UnseenSurface
from phone_host.output.axes import Axes
from phone_host.report.scan_report import ModelFigures, ScanReport
from phone_host.report.stereo_report import FailedPair
from phone_host.scan.field_bytes import field_bytes
from phone_host.scan.full_turn import LEAST_VIEWS, FullTurn
from phone_host.scan.mesh import size_of
from phone_host.scan.scan import Scan
from phone_host.scan.scan_model import ScanModel
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair
from phone_host.scan.stretches import WayCertainty
from phone_host.scan.surface_match import Match, SurfaceMatch
from phone_host.scan.tracking_words import OF_TABLE, OF_TURNING, Weakness
from phone_host.scan.turntable import TurntablePoses

_EMPTY_BOX = Diagnostic(
    "nothing of what the pairs show lies in the box",
    "move or enlarge --box, or leave it out to see where the thing lies",
)
_LEAST_WAY_M: Final = 5.0
"""Around a thing or a table the pairs see each other's surface, which holds them together better than their way does."""

_REMEDY = "turn it all the way round about one axis, by 3 to 15 degrees between the pairs"
_BOTH = "let both passes show the object's sides, and leave its shape as it is when you turn it over"


def own_axes(wanted: ScanWanted) -> Axes | None:
    """Return the axes that a model has from what the thing stands on; None: it has those of the camera."""
    if wanted.mat is not None:
        return Axes.MAT
    return Axes.TABLE if wanted.on_table else None


def report_of(
    scan: Scan,
    model: ScanModel,
    pairs: Sequence[ScannedPair | FailedPair],
    remarks: Sequence[Diagnostic],
    *,
    matcher: str,
    axes: Axes,
) -> ScanReport:
    """Make the report of a scan.

    Args:
        scan: that took the pairs.
        model: its surface.
        pairs: all, with those that could not be computed.
        remarks: what the user must know.
        matcher: its name.
        axes: of model.ply.
    """
    unused = unused_mat(scan)
    report = ScanReport(
        pairs=tuple(pairs),
        model=figures_of(scan, model),
        settings=scan.settings,
        geometry=scan.geometry,
        rectified_px=scan.size_px,
        matcher=matcher,
        axes=axes,
        remarks=(
            *([] if unused is None else [unused]),
            *remarks,
            *memory_remarks(scan),
            *way_remarks(scan.poses.certainty),
            *_box_remarks(scan, model),
            *_unseen_remarks(scan.wanted, model),
        ),
        keeps_field=keeps_field(scan),
        mat=scan.wanted.mat,
        unused_mat=unused,
        unseen=scan.wanted.unseen,
    )
    on_mat = report.on_mat
    return report if on_mat is None else replace(report, remarks=(*report.remarks, *on_mat.remarks))


def _box_remarks(scan: Scan, model: ScanModel) -> tuple[Diagnostic, ...]:
    """Say that the box that was asked for may be elsewhere, where there is no surface, or none of it was seen: it was closed out of nothing."""
    is_empty = scan.wanted.box is not None and not model.seen.any()
    return (_EMPTY_BOX,) if is_empty else ()


def _unseen_remarks(wanted: ScanWanted, model: ScanModel) -> tuple[Diagnostic, ...]:
    """Say that a choice for unseen surface changes nothing, because the surface is open; why a turn's is, its own remarks say."""
    is_open = not model.is_closed and not wanted.turntable and len(model.mesh.triangles) > 0
    if not is_open or wanted.unseen is UnseenSurface.FILL:
        return ()
    problem = f"--unseen {wanted.unseen.value} changes nothing, because the surface is not closed"
    return (Diagnostic(problem, "give --box, --mat, --object or --turntable", severity=Severity.NOTE),)


def require_something(report: ScanReport) -> None:
    """Refuse pairs of which nothing at all came.

    Raises:
        DataError: none was computed, none has depth, or none shows the mat, or a table with an object.
    """
    if not report.pairs:
        raise DataError(
            "no pair arrived, so there is no model",
            "try phone-host run: it shows which frames find no partner, and why",
        )
    if report.failed and not report.scanned:
        raise report.failed[0].none_of(len(report.pairs))
    if any(pair.weakness is Weakness.EMPTY_BOX for pair in report.scanned) and report.settings is None:
        raise DataError(
            "the mat is seen, but nothing of what the pairs show lies in the box",
            "move or enlarge --box, the middle of which counts from the sheet's middle, z up; or leave it out",
        )
    if (
        report.settings is None
        and report.mat is not None
        and any(pair.weakness is Weakness.NO_MAT for pair in report.scanned)
    ):
        raise DataError(
            f"the mat {report.mat.name} is not seen in any of {counted(len(report.scanned), 'pair')}",
            "show more of it, sharp and without glare; if another one lies there, name it, as in --mat 8x6:28mm:20mm:5x5",
        )
    if report.settings is None and report.unused_mat is not None:
        raise DataError(report.unused_mat.message, report.unused_mat.remedy)
    if report.settings is None:
        _require_table(report)
        require_turning(report)
        count = len(report.scanned)
        which = f"none of the {count} pairs" if count > 1 else "not even the only pair"
        why = next((remark for remark in report.remarks if not remark.is_note), None)
        raise DataError(
            f"{which} has depth{f': {why.message}' if why else ''}",
            (why.remedy if why else "")
            or "check that the pictures are sharp and bright, and that --calibration fits them",
        )


def _require_table(report: ScanReport) -> None:
    """Refuse pairs of which none shows an object on a table, though it was asked for.

    Raises:
        DataError: so it is; the reason is that of most pairs.
    """
    reasons = Counter(pair.weakness for pair in report.scanned if pair.weakness in OF_TABLE)
    most = reasons.most_common(1)[0][0] if reasons else Weakness.NONE
    of = f"in any of {counted(len(report.scanned), 'pair')}"
    if most is Weakness.NO_TABLE:
        raise DataError(
            f"no table was found {of}", "show more of it around the object, from above, and give it some texture"
        )
    if most is Weakness.BARE_TABLE:
        raise DataError(
            f"nothing stands on the table in the middle of the picture {of}",
            "aim at the object, and show where it stands; leave --object out to scan all that is in view",
        )


def require_turning(report: ScanReport) -> None:
    """Refuse pairs in which no object was seen to turn, though it was asked for.

    Raises:
        DataError: so it is; it says why most pairs cannot be used.
    """
    reasons = Counter(pair.weakness for pair in report.scanned if pair.weakness in OF_TURNING)
    most = reasons.most_common(1)[0][0] if reasons else Weakness.NONE
    if most is Weakness.NOTHING_TURNS:
        raise DataError("nothing turns in these pairs", "turn the object by 3 to 15 degrees between the pairs")
    if most is Weakness.ALL_TURNS:
        raise DataError(
            "the background of these pairs moves, too", "let the cameras stand still, or leave --turntable out"
        )
    if most is Weakness.OUTSIDE:
        raise DataError(
            "the turning object reaches beyond the picture", "move the cameras back, or the object to the middle"
        )


def figures_of(scan: Scan, model: ScanModel) -> ModelFigures:
    """Return a model in numbers, as the files hold it."""
    unseen_share, model = model.unseen_share if model.is_closed else math.nan, model.with_unseen(scan.wanted.unseen)
    known = model.noise_m[np.isfinite(model.noise_m)]
    noise_m, noise_p95_m = (float(np.percentile(known, share)) if len(known) else math.nan for share in (50, 95))
    volume = scan.volume
    return ModelFigures(
        points=len(model.mesh.points_m),
        triangles=len(model.mesh.triangles),
        size=size_of(model.mesh),
        noise_m=noise_m,
        noise_p95_m=noise_p95_m,
        error_scope=model.error_scope,
        unseen_share=unseen_share,
        memory_bytes=0 if volume is None else volume.memory_bytes,
        left_out=0 if volume is None else volume.left_out,
    )


def memory_remarks(scan: Scan) -> Sequence[Diagnostic]:
    """Say whether the model outgrew its memory: it has become coarser, or something is missing from it."""
    settings, remarks = scan.settings, list[Diagnostic]()
    if settings is not None and settings.voxel_m > scan.poses.begun_voxel_m:
        begun, now = (distance_text(each) for each in (scan.poses.begun_voxel_m, settings.voxel_m))
        remarks.append(
            Diagnostic(
                f"the model has filled its memory: its voxels became {now} wide, {begun} at first",
                "give a larger --memory, or a smaller --far",
            )
        )
    if scan.volume is not None and scan.volume.left_out:
        remarks.append(
            Diagnostic(
                "the model has filled its memory: what was seen later is missing from it",
                "give a larger --memory or --voxel, or a smaller --far",
            )
        )
    return remarks


def way_remarks(certainty: WayCertainty | None) -> Sequence[Diagnostic]:
    """Say how far poses far from the beginning may be off: the noise of the surface knows nothing of that.

    Args:
        certainty: of the way; None: something else than the way tells where the camera is, or nobody knows.
    """
    if certainty is None or certainty.length_m < _LEAST_WAY_M:
        return ()
    known = f"its farthest poses are known to \u00b1 {two_digits(1e3 * certainty.sigma_m)} mm"
    way = f"the camera's way is {distance_text(certainty.length_m)} long"
    if certainty.loops:
        return (
            Diagnostic(f"{way} and {counted(certainty.loops, 'loop')} were closed: {known}", severity=Severity.NOTE),
        )
    remedy = "come back to where you began, and show it for some pairs from the same side"
    return (Diagnostic(f"{way} and no loop was closed: {known}", remedy, severity=Severity.NOTE),)


def turn_remarks(scan: Scan) -> Sequence[Diagnostic]:
    """Say whether the turn was found, and whether it is closed."""
    poses = scan.poses
    if not isinstance(poses, TurntablePoses) or not scan.fused:
        return ()
    if poses.views < LEAST_VIEWS:
        few = (
            f"only {counted(poses.views, 'pair')} of the object as it turns: {LEAST_VIEWS} are needed to find its axis"
        )
        return (Diagnostic(few, _REMEDY, severity=Severity.FAIL),)
    turn = poses.fit.turn
    if turn is None:
        return (
            Diagnostic(
                "the pairs do not agree on the axis about which the object turns", _REMEDY, severity=Severity.FAIL
            ),
        )
    return (*_match_remarks(poses.fit.match), *_closing_remarks(turn))


def _match_remarks(match: SurfaceMatch | None) -> Sequence[Diagnostic]:
    if match is None:
        return ()
    if match.match is Match.NONE:
        return (Diagnostic("this pass does not fit the surface of the earlier one", _BOTH, severity=Severity.FAIL),)
    if match.match is Match.SEVERAL:
        several = "this pass fits the earlier one in several ways, and the colours do not tell which is right"
        return (Diagnostic(several, "put a mark on the object, and scan both passes again", severity=Severity.FAIL),)
    fits = f"{match.share:.0%} of this pass lie on the earlier one, {distance_text(match.off_m)} off on average"
    return (Diagnostic(fits, severity=Severity.NOTE),)


def _closing_remarks(turn: FullTurn) -> Sequence[Diagnostic]:
    degrees = f"{math.degrees(turn.span):.0f} degrees"
    if turn.is_closed:
        gap = f"{abs(math.degrees(turn.gap)):.2g} degrees"
        closed = f"the end met the beginning {gap} off, which was distributed, and lies {distance_text(turn.closed_m)} from it now"
        return (Diagnostic(f"the turn of {degrees} is closed: {closed}", severity=Severity.NOTE),)
    if turn.span < 2 * math.pi:
        return (Diagnostic(f"the object has turned by {degrees} only", "go on until its first side shows again"),)
    words = "the end of the turn was not recognised as its beginning: the surface may be doubled there"
    return (Diagnostic(words, "go on turning for a few pairs more, and show more texture"),)


def keeps_field(scan: Scan) -> bool:
    """Whether another pass can be added: there is a turn, and it was put together with the earlier pass if there was one."""
    poses = scan.poses
    if not isinstance(poses, TurntablePoses) or poses.fit.turn is None:
        return False
    return poses.fit.match is None or poses.fit.is_on_earlier_pass


def field_of_turn(scan: Scan) -> bytes:
    """Return the field of a turn, for another pass; empty: none can be added."""
    return field_bytes(scan.volume, scan.carved) if scan.volume is not None and keeps_field(scan) else b""


def unused_mat(scan: Scan) -> Diagnostic | None:
    """Return what must be said of a printed mat that is in view, though none is asked for; None: none was found."""
    if scan.unused_mat is None:
        return None
    other = "--turntable" if scan.wanted.turntable else "--object" if scan.wanted.on_table else ""
    in_place = f" in place of {other}" if other else ""
    remedy = f"use {scan.unused_mat.option}{in_place} to scan the object on it, or take the mat away"
    return Diagnostic("a printed mat is in view, but the scan does not use it", remedy)
