"""A scan's surface on a terminal."""

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from phone_host.geometry.se3 import SE3
from phone_host.model import Side
from phone_host.run.live_scan import LiveScan
from phone_host.run.scan_view import ScanPicture, small_view
from phone_host.scan.mesh import Mesh
from phone_host.scan.scan_wanted import ScanWanted
from tests.support.plane_films import CORNER, plane_view, texture
from tests.support.screen import Screen
from tests.support.turning_things import processed_of

RED, BLUE = (200, 0, 0), (0, 0, 200)


def wall(depth_m: float, colour: tuple[int, int, int], side_m: float = 0.4) -> Mesh:
    """Points of a square that faces the viewer, close to each other."""
    x, y = np.meshgrid(np.linspace(-side_m / 2, side_m / 2, 200), np.linspace(-side_m / 2, side_m / 2, 200))
    points = np.stack([x, y, np.full_like(x, depth_m)], axis=-1).reshape(-1, 3).astype(np.float32)
    return Mesh(points, np.full((len(points), 3), colour, np.uint8), np.zeros((0, 3), np.int32))


def test_the_nearest_surface_is_seen_and_fills_the_picture() -> None:
    """Before a blue wall stands a smaller red one: red in the middle, blue around it, in nearly all rows."""
    view = small_view([wall(1.0, RED, 0.2), wall(1.05, BLUE)], 60, 40)
    assert view.colours.shape == (40, 60, 3)
    assert tuple(view.colours[20, 30]) == RED
    shown = {tuple(colour) for colour in view.colours[view.is_seen]}
    assert shown == {RED, BLUE}
    assert view.is_seen.any(axis=1).mean() > 0.9
    columns = np.flatnonzero(view.is_seen.any(axis=0))
    assert abs((columns[0] + columns[-1]) / 2 - 29.5) < 3
    assert abs(np.ptp(columns) - 40) < 10  # a square stays one


@pytest.mark.parametrize("meshes", [[], [Mesh.empty()], [wall(1.0, RED, 0.0)]])
def test_nothing_to_see_is_an_empty_picture(meshes: list[Mesh]) -> None:
    """No points, or all in one place."""
    view = small_view(meshes, 20, 10)
    assert not view.is_seen.any()


@pytest.mark.parametrize(("width", "height"), [(30, 8), (60, 24), (200, 60)])
def test_a_terminal_shows_words_and_surface(tmp_path: Path, width: int, height: int) -> None:
    """Words stand on top, the surface below; it fits, and nothing stays when it ends."""
    stream = io.StringIO()
    live = LiveScan(ScanWanted(voxel_m=0.01), Side.LEFT, tmp_path, waits=False, is_timeless=False)
    live.scan.take("0", 0.0, processed_of(plane_view(SE3.identity(), texture(), CORNER)))
    live.renew_surface()
    console = Console(file=stream, width=width, height=height, force_terminal=True, color_system="truecolor")
    screen = Screen(width, height)
    with ScanPicture(live, console) as picture:
        picture.refresh()
        screen.feed(stream.getvalue().replace("\n", "\r\n"))
        shown = "\n".join(screen.rows)
        assert "waiting for the first pair" in shown
        assert shown.count("\u2580") > width
        stream.seek(0)
        stream.truncate()
    screen.feed(stream.getvalue().replace("\n", "\r\n"))
    assert screen.everything == []
