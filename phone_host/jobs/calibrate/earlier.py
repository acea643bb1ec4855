"""phone-host calibrate --from: what an earlier calibration gives to a new one."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from common.errors import DataError, SettingsError
from common.imagesize.head import size_text
from common.words import counted
from phone_host.calibration.solve.calibrate import Sizes, calibrate, solve_pose
from phone_host.calibration.solve.earlier_views import board_of, new_ones, pairs_of, together, views_of
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.board_names import board_name, named_board
from phone_host.calibration.target.cameras_beside import first_sizes
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair
from phone_host.jobs.calibrate.board import AUTO, Named, named
from phone_host.jobs.calibrate.request import CalibrateRequest
from phone_host.model import CameraModel, Rig, Side
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.output.rig_views import RigViews
from phone_host.output.rig_yaml import read_rig_views
from phone_host.report.calibration_report import Known, Origin
from phone_host.settings import most_pixels
from phone_host.stereo.scaled_rig import is_scaling, scaled_rig
from phone_host.stereo.view_files import ViewFiles


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """What is to be calibrated with.

    Attributes:
        board: the board in the new pictures.
        side: which camera is the board's.
        path: of the earlier calibration.
        rig: the earlier one; None: there is none.
        views: what it was computed from; None: not known, or not wanted.
    """

    board: Board
    side: Side
    path: Path
    rig: Rig | None = None
    views: RigViews | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What is asked for, with what the earlier calibration says.

    Attributes:
        named: the board.
        rig: the earlier calibration; None: there is none.
        views: what it was computed from; None: not known.
    """

    named: Named
    rig: Rig | None = None
    views: RigViews | None = None


def asked_of(request: CalibrateRequest) -> Asked:
    """Return the board that is asked for, and the earlier calibration if there is one.

    Raises:
        SettingsError: one of them is missing, not valid, or contradicts the earlier calibration.
        DataError: the earlier calibration cannot be read or added to.
    """
    if request.earlier is None:
        if request.pose_only:
            raise SettingsError("--pose-only keeps the lenses of an earlier calibration", "name it: --from rig.yaml")
        return Asked(named=named(request.board or AUTO, request.square_mm))
    rig, views = read_own_rig(request.earlier), read_rig_views(request.earlier)
    if views is None and not request.pose_only:
        raise DataError(
            f"{request.earlier} does not hold the corners it was computed from",
            "calibrate from all pictures together, or give --pose-only to keep its lenses",
        )
    asked = named(request.board or AUTO, request.square_mm) if views is None else _named_again(request, board_of(views))
    return Asked(named=asked, rig=rig, views=views)


def _named_again(request: CalibrateRequest, before: Board) -> Named:
    """Return the board, where what is not said is as it was."""
    text = (request.board or AUTO).strip()
    if request.pose_only and request.square_mm is not None:
        return named(text, request.square_mm)
    side_mm = _mm(before) if request.square_mm is None else request.square_mm
    given = before if text.lower() == AUTO else named_board(text, side_mm)
    if request.pose_only and board_name(given) != board_name(before):
        return named(text, None)  # another board has a square of its own
    for option, now, earlier in (
        ("--board", board_name(replace(given, square_m=before.square_m)), board_name(before)),
        ("--square", f"{side_mm:g} mm", f"{_mm(before):g} mm"),
    ):
        if now != earlier:
            raise SettingsError(
                f"{option} says {now}, and the pictures of {request.earlier} show {earlier}",
                f"leave {option} out and show the same board, or calibrate without --from",
            )
    return Named(before, _mm(before))


def _mm(board: Board) -> float:
    return board.square_m * 1e3


def series_of(request: CalibrateRequest, asked: Asked, find: Callable[[Named], Known]) -> tuple[Series, Known]:
    """Find the board, and join what is known of the earlier calibration.

    Args:
        request: of the calibration.
        asked: what it says.
        find: finds a board in the new pictures, or checks it there.

    Raises:
        SettingsError: an option contradicts the pictures.
        DataError: the pictures show no board, or another one than the earlier ones.
    """
    known = find(asked.named) if asked.views is None else _known(request, asked, find)
    if asked.rig is None:
        return Series(board=known.board, side=request.board_side or Side.LEFT, path=Path()), known
    series = Series(
        board=known.board,
        side=request.board_side or asked.rig.board_side,
        path=request.earlier or Path(),
        rig=asked.rig,
        views=None if request.pose_only else asked.views,
    )
    return series, known


def _known(request: CalibrateRequest, asked: Asked, find: Callable[[Named], Known]) -> Known:
    """Find the board; one that is not named is that of the earlier calibration."""
    if request.board is not None or request.square_mm is not None:
        return find(asked.named)
    try:
        return replace(find(asked.named), origin=Origin.EARLIER)
    except SettingsError as error:
        raise DataError(
            f"the new pictures show another board than {request.earlier} holds",
            "show the same board, or calibrate without --from",
        ) from error


def every_pair(series: Series, pairs: list[BoardPair], sizes_px: Sizes) -> list[BoardPair]:
    """Return the pairs to calibrate from: those of the earlier calibration that are wanted, and the new ones behind them.

    Raises:
        DataError: the earlier calibration is for other images, or holds all of these.
    """
    if series.rig is None or series.views is None:
        return pairs
    _require_sizes(series.rig, series.path, sizes_px)
    earlier = pairs_of(series.views)
    fresh = new_ones(earlier, pairs)
    if pairs and not fresh:
        raise DataError(f"all of these pictures are in {series.path} already", "give other ones")
    return together(earlier, fresh)


def calibrated(series: Series, pairs: list[BoardPair], sizes_px: Sizes) -> Calibration:
    """Calibrate from the pairs of `every_pair`, and what the series has besides.

    Raises:
        DataError: too few pairs are left, or the earlier lenses fit no images of this size.
    """
    if series.rig is None:
        return calibrate(pairs, series.board, sizes_px, series.side)
    if series.views is None:
        earlier = scaled_rig(series.rig, *sizes_px)
        found = solve_pose(pairs, series.board, replace(earlier, board_side=series.side))
    else:
        found = calibrate(pairs, series.board, sizes_px, series.side)
    return replace(found, rig=replace(found.rig, time_offset=series.rig.time_offset))


def saved_views(series: Series, found: Calibration, seen: list[BoardPair]) -> RigViews | None:
    """Return what rig.yaml keeps of the pairs as they were seen; None after --pose-only, whose lenses come from others."""
    if series.rig is not None and series.views is None:
        return None
    return views_of(found, seen, series.board)


def with_earlier_cameras(series: Series, rig: Rig) -> Rig:
    """Return the rig with the cameras of the earlier one, where nothing newer is known."""
    if series.rig is None:
        return rig
    return replace(
        rig,
        left_camera=rig.left_camera or series.rig.left_camera,
        right_camera=rig.right_camera or series.rig.right_camera,
    )


def notes(series: Series, pairs: list[BoardPair], sizes_px: Sizes) -> list[str]:
    """Say what was taken from the earlier calibration, and how."""
    if series.rig is None:
        return []
    if series.views is not None:
        fresh = len(new_ones(pairs_of(series.views), pairs))
        known = f"; {len(pairs) - fresh} were in it already" if fresh < len(pairs) else ""
        return [
            f"from     {counted(len(series.views.names), 'pair')} of {series.path} and {counted(fresh, 'new one')}{known}"
        ]
    rows = [f"from     {series.path}: its lenses are kept, the relative pose is new"]
    for side, model, size_px in (("left", series.rig.left, sizes_px[0]), ("right", series.rig.right, sizes_px[1])):
        if size_px != _size(model):
            way = "scaled" if is_scaling(_size(model), size_px) else "cropped to its middle"
            rows.append(f"         the {side} lens is {way}: {size_text(_size(model))} to {size_text(size_px)} px")
    return rows


def require_first_sizes(files: ViewFiles, asked: Asked, request: CalibrateRequest) -> None:
    """Check the size of the first pictures before all of them are searched for a board.

    Raises:
        DataError: the earlier calibration is for images of another size.
    """
    if asked.rig is None:
        return
    sizes_px = first_sizes(files, most_pixels(None, request.pictures.max_megapixels), request.pictures.mounted)
    if sizes_px is None:
        return
    if request.pose_only:
        scaled_rig(asked.rig, *sizes_px)
    else:
        _require_sizes(asked.rig, request.earlier or Path(), sizes_px)


def _require_sizes(rig: Rig, path: Path, sizes_px: Sizes) -> None:
    for side, model, size_px in (("left", rig.left, sizes_px[0]), ("right", rig.right, sizes_px[1])):
        if size_px != _size(model):
            raise DataError(
                f"the new {side} pictures are {size_text(size_px)} px, those of {path} {size_text(_size(model))} px",
                "take them at that size, or calibrate from them alone, without --from",
            )


def _size(model: CameraModel) -> tuple[int, int]:
    return model.width_px, model.height_px
