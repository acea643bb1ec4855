"""phone-host calibrate --from: what an earlier calibration gives to a new one."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from common.errors import DataError, SettingsError
from common.imagesize.head import size_text
from phone_host.calibration.board_names import no_square
from phone_host.calibration.board_pairs import BoardPair, Calibration
from phone_host.calibration.calibrate import Sizes, calibrate
from phone_host.calibration.earlier_views import board_of, new_ones, pairs_of, together, views_of
from phone_host.calibration.pose_only import solve_pose
from phone_host.calibration.target import Board
from phone_host.model import CameraModel, Rig, Side
from phone_host.output.rig_views import RigViews
from phone_host.output.rig_yaml import read_rig, read_rig_views
from phone_host.stereo.scaled_rig import is_scaling, scaled_rig
from phone_host.verbs.calibrate.board import AUTO, Known, Named, Origin, named


@dataclass(frozen=True, slots=True, kw_only=True)
class Session:
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


def asked_of(options: argparse.Namespace) -> Named | None:
    """Read --board and --square; None: they are to be those of the earlier calibration.

    Raises:
        SettingsError: one of them is missing or not valid.
    """
    if options.earlier is not None and options.board is None and options.square is None:
        return None
    return named(options.board or AUTO, options.square)


def session_of(
    options: argparse.Namespace, asked: Named | None, find: Callable[[Named], Known]
) -> tuple[Session, Known]:
    """Find the board, and read the earlier calibration if there is one.

    Args:
        options: the command's.
        asked: what they say of the board.
        find: finds a board in the new pictures, or checks it there.

    Raises:
        SettingsError: an option is missing or contradicts the earlier calibration or the pictures.
        DataError: the earlier calibration cannot be added to, or the pictures show no board.
    """
    if options.earlier is None:
        if options.pose_only:
            raise SettingsError("--pose-only keeps the lenses of an earlier calibration", "name it: --from rig.yaml")
        known = find(asked or named(AUTO, options.square))
        return Session(board=known.board, side=Side(options.board_side or Side.LEFT.value), path=Path()), known
    rig, views = read_rig(options.earlier), read_rig_views(options.earlier)
    if views is None and not options.pose_only:
        raise DataError(
            f"{options.earlier} does not hold the corners it was computed from",
            "calibrate from all pictures together, or give --pose-only to keep its lenses",
        )
    known = _known(options, asked, views, find)
    session = Session(
        board=known.board,
        side=Side(options.board_side or rig.board_side.value),
        path=options.earlier,
        rig=rig,
        views=None if options.pose_only else views,
    )
    return session, known


def _known(
    options: argparse.Namespace, asked: Named | None, views: RigViews | None, find: Callable[[Named], Known]
) -> Known:
    if asked is None and views is None:
        raise no_square()
    if asked is None:
        assert views is not None
        return Known(board_of(views), Origin.EARLIER)
    known = find(asked)
    if views is None or options.pose_only:
        return known
    before = board_of(views)
    if _turned(known.board) == before and known.origin is Origin.IMAGES:
        return Known(before, known.origin)
    if replace(known.board, marks=None) != before:
        raise SettingsError(
            f"--board and --square differ from those of {options.earlier}", "leave them out, and show the same board"
        )
    return known


def _turned(board: Board) -> Board:
    """The same board, held the other way."""
    return replace(board, columns=board.rows, rows=board.columns)


def calibrated(session: Session, pairs: list[BoardPair], sizes_px: Sizes) -> Calibration:
    """Calibrate from the new pairs and what the session has.

    Raises:
        DataError: too few pairs are left, or the earlier calibration is for other images.
    """
    if session.rig is None:
        return calibrate(pairs, session.board, sizes_px, session.side)
    if session.views is None:
        earlier = scaled_rig(session.rig, *sizes_px)
        found = solve_pose(pairs, session.board, replace(earlier, board_side=session.side))
    else:
        _require_sizes(session, sizes_px)
        earlier_pairs = pairs_of(session.views)
        fresh = new_ones(earlier_pairs, pairs)
        if pairs and not fresh:
            raise DataError(f"all of these pictures are in {session.path} already", "give other ones")
        found = calibrate(together(earlier_pairs, fresh), session.board, sizes_px, session.side)
    return replace(found, rig=replace(found.rig, time_offset=session.rig.time_offset))


def saved_views(session: Session, found: Calibration, pairs: list[BoardPair]) -> RigViews | None:
    """Return what rig.yaml keeps of the views; None after --pose-only, whose lenses come from others."""
    if session.rig is not None and session.views is None:
        return None
    return views_of(found, every_pair(session, pairs), session.board)


def every_pair(session: Session, pairs: list[BoardPair]) -> list[BoardPair]:
    """Return the pairs that the rig was computed from: those of the earlier calibration that are wanted, and the new ones."""
    if session.views is None:
        return pairs
    earlier = pairs_of(session.views)
    return together(earlier, new_ones(earlier, pairs))


def with_earlier_cameras(session: Session, rig: Rig) -> Rig:
    """Return the rig with the cameras of the earlier one, where nothing newer is known."""
    if session.rig is None:
        return rig
    return replace(
        rig,
        left_camera=rig.left_camera or session.rig.left_camera,
        right_camera=rig.right_camera or session.rig.right_camera,
    )


def notes(session: Session, pairs: list[BoardPair], sizes_px: Sizes) -> list[str]:
    """Say what was taken from the earlier calibration, and how."""
    if session.rig is None:
        return []
    if session.views is not None:
        fresh = len(every_pair(session, pairs)) - len(session.views.names)
        known = f"; {len(pairs) - fresh} were in it already" if fresh < len(pairs) else ""
        return [f"from     {len(session.views.names)} pairs of {session.path} and {fresh} new ones{known}"]
    rows = [f"from     {session.path}: its lenses are kept, the relative pose is new"]
    for side, model, size_px in (("left", session.rig.left, sizes_px[0]), ("right", session.rig.right, sizes_px[1])):
        if size_px != _size(model):
            way = "scaled" if is_scaling(_size(model), size_px) else "cropped to its middle"
            rows.append(f"         the {side} lens is {way}: {size_text(_size(model))} to {size_text(size_px)} px")
    return rows


def _require_sizes(session: Session, sizes_px: Sizes) -> None:
    assert session.rig is not None
    for side, model, size_px in (("left", session.rig.left, sizes_px[0]), ("right", session.rig.right, sizes_px[1])):
        if size_px != _size(model):
            raise DataError(
                f"the new {side} pictures are {size_text(size_px)} px, those of {session.path} {size_text(_size(model))} px",
                "take them at that size, or give --pose-only, which scales the lenses",
            )


def _size(model: CameraModel) -> tuple[int, int]:
    return model.width_px, model.height_px
