"""The scan's step: what it tells, the surface as it grows, and what can be saved."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from phone_host.geometry.se3 import SE3
from phone_host.report.scan_report import scan_verdict
from phone_host.scan.mesh import Mesh
from phone_host.scan.patches import Patches
from phone_host.scan.surface_error import ErrorScope
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.web.source import Activity, Do, ScanState
from tests.scan.test_scan_report import GOOD, MODEL
from tests.support.plane_films import CORNER, plane_view, texture
from tests.support.programs import until
from tests.web.conftest import LAPTOP, PHONE, Complaints, Opener
from tests.web.played import Played

FILES = ("model.ply", "report.json")


class Growing:
    """A volume that shows more of a corner with each call."""

    def __init__(self) -> None:
        self.volume = Volume(VolumeSettings(voxel_m=0.01, far_m=3.0))
        self.patches = Patches(1)

    def show(self, columns: int) -> None:
        """Fuse the first columns of the view."""
        view = plane_view(SE3.identity(), texture(), CORNER)
        view.depth_m[:, columns:] = np.nan
        self.volume.fuse(view, SE3.identity())
        self.patches.renew(self.volume)


def _roughness(page: Any) -> float:
    """By how much neighbours differ in the middle of the surface's picture."""
    picture = cv2.imdecode(np.frombuffer(page.locator("#scan-model").screenshot(), np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    height, width = picture.shape[:2]
    middle = picture[3 * height // 8 : 5 * height // 8, 3 * width // 8 : 5 * width // 8]
    return float(np.abs(np.diff(middle.astype(float), axis=1)).mean())


@pytest.mark.parametrize("size", [PHONE, LAPTOP])
def test_the_surface_grows_until_it_is_saved(
    program: Played, opened: Opener, complaints: Complaints, size: dict[str, int], tmp_path: Path
) -> None:
    """Start asks for a scan with the given fineness; what is new appears by itself; a scan that is over offers its files; the next one begins empty."""
    growing = Growing()
    page = opened("scan", size)
    page.wait_for_selector("#panel-scan:not([hidden])")
    page.fill("#scan-voxel", "5mm")
    page.click("#scan-go")
    page.wait_for_function("() => document.getElementById('scan-go').textContent === 'Stop'")
    assert program.commands[-1].do is Do.SCAN
    assert program.commands[-1].values == {
        "voxel": "5mm",
        "box": "",
        "mat": "",
        "turntable": "",
        "object": "",
        "unseen": "",
    }
    assert page.text_content("#scan-none") == "No surface yet"
    words = "2 pairs in the model: moved too fast: go back to where it was, and move more slowly"
    growing.show(60)
    program.patches = growing.patches
    program.change(scan=ScanState(words=words, level="bad", pairs=5, fused=2))
    page.wait_for_selector("#scan-state[data-level=bad]")
    assert "move more slowly" in page.text_content("#scan-words")
    assert page.text_content("#scan-pairs") == "2 of 5 pairs are in the model"
    page.wait_for_function("() => +document.getElementById('scan-model').dataset.parts > 0")
    few = int(page.get_attribute("#scan-model", "data-parts"))
    growing.show(240)
    page.wait_for_function("few => +document.getElementById('scan-model').dataset.parts > few", arg=few)
    assert page.is_hidden("#scan-none")
    page.wait_for_function("() => document.getElementById('scan-model').dataset.drawn")
    for name in FILES:
        (tmp_path / name).write_bytes(name.encode())
    over = ScanState(words="5 of 9 pairs are in the model", level="good", pairs=9, fused=5, folder=str(tmp_path), files=FILES)  # fmt: skip
    page.click("#scan-go")
    page.wait_for_function("() => document.getElementById('scan-answer').textContent !== ''")
    program.change(activity=Activity.ENDING)
    page.wait_for_function("() => document.getElementById('activity').textContent.includes('ending')")
    program.change(scan=over, activity=Activity.IDLE)
    page.wait_for_selector("#scan-saved:not([hidden])")
    assert page.text_content("#scan-answer") == ""
    assert [link.text_content() for link in page.query_selector_all("#scan-files a")] == list(FILES)
    with page.expect_download() as saved:
        page.click("#scan-files a >> nth=0")
    assert Path(saved.value.path()).read_bytes() == b"model.ply"
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    program.patches = Patches(1)
    page.click("#scan-go")
    page.wait_for_function("() => +document.getElementById('scan-model').dataset.parts === 0")
    assert complaints == []


@pytest.mark.parametrize(("scope", "level"), [(ErrorScope.DRIFT, "good"), (ErrorScope.NOISE, "warning")])
def test_a_scan_that_is_over_states_its_error_and_what_was_never_in_view(
    program: Played, opened: Opener, tmp_path: Path, scope: ErrorScope, level: str
) -> None:
    """The report's sentence stands on the step whole, and its mark is green only where the stated error includes drift."""
    verdict, words = scan_verdict(replace(GOOD, model=replace(MODEL, unseen_share=0.25, error_scope=scope)))
    program.patches = Patches(1)
    program.scan = ScanState(words=words, level=verdict.value, pairs=5, fused=5, folder=str(tmp_path), files=FILES)
    page = opened("scan")
    page.wait_for_selector(f"#scan-state[data-level={level}]")
    assert page.inner_text("#scan-words") == (
        f"All 5 pairs are in the model. Expected surface error: \u00b11.2 mm ({scope.value}). "
        "25 % was never in view and is filled in."
    )
    assert page.inner_text("#scan-pairs") == ""
    mark = page.evaluate("getComputedStyle(document.querySelector('#scan-state i')).backgroundColor")
    assert mark == page.evaluate(
        "level => { document.body.style.color = `var(--${level})`; return getComputedStyle(document.body).color; }",
        level,
    )


def test_a_surface_is_drawn_and_turned_by_keys(program: Played, opened: Opener, complaints: Complaints) -> None:
    """Something stands in the picture; an arrow key turns it; as shape its texture is gone."""
    growing = Growing()
    growing.show(240)
    program.patches, program.scan = growing.patches, ScanState(words="1 pair in the model: go on", level="good")
    program.activity = Activity.SCANNING
    page = opened("scan")
    page.wait_for_function("() => +document.getElementById('scan-model').dataset.parts > 0")
    page.wait_for_function("() => document.getElementById('scan-model').dataset.drawn")
    before = page.get_attribute("#scan-model", "data-drawn")
    page.focus("#scan-model")
    page.keyboard.press("ArrowLeft")
    page.wait_for_function("was => document.getElementById('scan-model').dataset.drawn !== was", arg=before)
    coloured = _roughness(page)
    page.check("input[name=scan-paint][value=shape]", force=True)
    page.wait_for_timeout(300)
    assert _roughness(page) < coloured / 2
    assert complaints == []


_HORNED = """async () => {
  const { Model } = await import('/static/model.js');
  const [canvas, over] = [0, 1].map(() => document.body.appendChild(document.createElement('canvas')));
  for (const each of [canvas, over]) each.style.cssText = 'position: fixed; left: 0; top: 0; width: 900px; height: 450px';
  const points = [];
  for (let at = 0; at < 3000; at++) points.push(30 * (at % 2), 30 * ((at >> 1) % 2), (at * 7) % 101);
  for (let at = 0; at < 5; at++) points.push(15, 15, 106);
  const model = new Model(canvas, over);
  const [low, step] = [[0, 0, 0], 0.001];
  const colours = new Uint8Array(points.length), noise = new Uint8Array(points.length / 3), seen = noise.map(() => 1);
  model.stands('mat');
  model.show({ low, step, points: new Uint16Array(points), triangles: new Uint16Array([0, 1, 2]), colours, noise, seen });
  while (!canvas.dataset.drawn) await new Promise(requestAnimationFrame);
  const mesh = model.parts.get('');
  mesh.updateWorldMatrix(true, false);
  const shown = points.flatMap((_, at) => {
    if (at % 3) return [];
    const place = mesh.localToWorld(mesh.position.clone().set(...points.slice(at, at + 3))).project(model.camera);
    return [Math.abs(place.x), Math.abs(place.y)];
  });
  return Math.max(...shown);
}"""
"""Shows a column of 100 mm with a horn of 6 mm that has one point in 600; returns how far its points lie from the middle, 1: at the edge."""


_ON_MAT = """async () => {
  const { Model } = await import('/static/model.js');
  const [canvas, over] = [0, 1].map(() => document.body.appendChild(document.createElement('canvas')));
  const points = [];
  for (let at = 0; at < 2500; at++) points.push((at * 7) % 201, (at * 13) % 161, 10);
  for (let at = 0; at < 500; at++) points.push(80 + 40 * (at % 2), 60 + 40 * ((at >> 1) % 2), 10 + ((at * 7) % 101));
  const model = new Model(canvas, over);
  const [colours, noise, seen] = [points.length, points.length / 3, points.length / 3].map((count) => new Uint8Array(count).fill(1));
  model.stands('mat');
  model.show({ low: [0, 0, -0.01], step: 0.001, points: new Uint16Array(points), triangles: new Uint16Array([0, 1, 2]), colours, noise, seen });
  return model.middle();
}"""
"""Shows a mat of 200 x 160 mm with a column of 40 x 40 x 100 mm on it, whose foot begins at 80, 60 mm; returns the first box."""


def test_the_first_box_holds_all_that_stands_on_the_mat(opened: Opener) -> None:
    """From the mat to the top, with a small margin, and little of the bare mat."""
    box = opened("scan").evaluate(_ON_MAT)
    for axis, (low, high) in enumerate(((0.08, 0.12), (0.06, 0.10), (0.0, 0.10))):
        assert low - 0.007 <= box["low"][axis] <= low
        assert high - 0.001 <= box["high"][axis] <= high + 0.007


def test_a_thing_is_seen_whole_with_its_horn(opened: Opener, complaints: Complaints) -> None:
    """What is small and sticks out is in the first picture, too, with a margin; the picture is well filled."""
    assert 0.8 < opened("scan").evaluate(_HORNED) < 0.99
    assert complaints == []


def _box(page: Any) -> list[float]:
    """The sides and the middle of the box in the field, mm."""
    sides, middle = page.input_value("#scan-box").split("@")
    return [float(value) for value in [*sides.split("x"), *middle.split(",")]]


@pytest.mark.parametrize("size", [PHONE, LAPTOP])
def test_a_box_is_drawn_pulled_typed_and_taken_away(
    program: Played, opened: Opener, complaints: Complaints, size: dict[str, int]
) -> None:
    """A box begins around most of the surface; a pulled dot moves one face only; each change reaches the scan; what is no box is said."""
    growing = Growing()
    growing.show(240)
    program.patches, program.scan = growing.patches, ScanState(words="1 pair in the model: go on", level="good")
    program.activity = Activity.SCANNING
    page = opened("scan", size)
    page.wait_for_function("() => +document.getElementById('scan-model').dataset.parts > 0")
    page.wait_for_function("() => document.getElementById('scan-model').dataset.drawn")
    page.click("#scan-draw")
    page.wait_for_function("() => document.getElementById('scan-draw').textContent === 'Remove box'")
    until(lambda: bool(program.commands), "the box reaches the scan")
    assert program.commands[-1].do is Do.CROP
    assert program.commands[-1].values == {"box": page.input_value("#scan-box")}
    begun, before = page.input_value("#scan-box"), _box(page)
    assert all(side >= 1 for side in before[:3])
    page.wait_for_function("() => document.getElementById('scan-model').dataset.handles")
    page.locator("#scan-model").scroll_into_view_if_needed()
    dots = [
        [float(value) for value in dot.split(",")]
        for dot in page.get_attribute("#scan-model", "data-handles").split(" ")
    ]
    frame = page.locator("#scan-model").bounding_box()
    assert frame is not None
    x, y, way_x, way_y = dots[0]
    length = float(np.hypot(way_x, way_y))
    page.mouse.move(frame["x"] + x, frame["y"] + y)
    page.mouse.down()
    page.mouse.move(frame["x"] + x + 30 * way_x / length, frame["y"] + y + 30 * way_y / length, steps=4)
    page.mouse.up()
    page.wait_for_function("was => document.getElementById('scan-box').value !== was", arg=begun)
    after = _box(page)
    changed = [axis for axis in range(3) if abs(after[axis] - before[axis]) > 1]
    assert len(changed) == 1
    others = [axis for axis in range(3) if axis not in changed]
    assert [after[3 + axis] for axis in others] == [before[3 + axis] for axis in others]
    pulled = page.input_value("#scan-box")
    until(lambda: program.commands[-1].values == {"box": pulled}, "the pulled box reaches the scan")
    page.fill("#scan-box", "300x300")
    page.dispatch_event("#scan-box", "change")
    page.wait_for_function("() => document.getElementById('scan-answer').textContent.includes('not a box')")
    page.fill("#scan-box", "300x200x100@0,10,600")
    page.dispatch_event("#scan-box", "change")
    page.wait_for_function("() => !document.getElementById('scan-answer').textContent")
    page.click("#scan-draw")
    page.wait_for_function("() => document.getElementById('scan-draw').textContent === 'Draw box'")
    assert page.input_value("#scan-box") == ""
    until(lambda: program.commands[-1].values == {"box": ""}, "the scan keeps everything again")
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    assert complaints == []


@pytest.mark.parametrize(
    ("kind", "sheet", "wanted"),
    [
        ("mat", "", {"mat": "usual", "turntable": "", "object": ""}),
        ("mat", "8x6:30mm:22mm:4x4", {"mat": "8x6:30mm:22mm:4x4", "turntable": "", "object": ""}),
        ("turntable", "", {"mat": "", "turntable": "yes", "object": ""}),
        ("object", "", {"mat": "", "turntable": "", "object": "yes"}),
    ],
)
def test_what_is_scanned_is_chosen(
    program: Played, opened: Opener, kind: str, sheet: str, wanted: dict[str, str]
) -> None:
    """Only a mat asks for its sheet; the command gets what the options of `scan` are."""
    program.patches = Patches(1)
    page = opened("scan")
    page.wait_for_selector("#panel-scan:not([hidden])")
    assert page.is_hidden("#scan-mat")
    page.select_option("#scan-kind", kind)
    assert page.is_visible("#scan-mat") is (kind == "mat")
    if sheet:
        page.fill("#scan-mat", sheet)
    page.click("#scan-go")
    page.wait_for_function("() => document.getElementById('scan-go').textContent === 'Stop'")
    assert program.commands[-1].values == {"voxel": "", "box": "", **wanted, "unseen": ""}


def test_what_stands_on_a_mat_stands_upright(program: Played, opened: Opener) -> None:
    """A red post on a blue plate, z up: on the screen the post stands above the middle of the plate; the left of the plate, which nobody saw, is hatched."""
    z, turn = np.meshgrid(np.linspace(0, 0.1, 60), np.linspace(0, 2 * np.pi, 60))
    post = np.stack([0.01 * np.cos(turn), 0.01 * np.sin(turn), z], axis=-1).reshape(-1, 3)
    x, y = np.meshgrid(np.linspace(-0.08, 0.08, 60), np.linspace(-0.08, 0.08, 60))
    plate = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    corners = [[n, n + 1, n + 60, n + 1, n + 61, n + 60] for n in range(59 * 60) if n % 60 < 59]
    quads = np.array(corners, np.int32).reshape(-1, 3)
    colours = np.repeat(np.array([(255, 0, 0), (0, 0, 255)], np.uint8), 3600, axis=0)
    mesh = Mesh(np.concatenate([post, plate]).astype(np.float32), colours, np.concatenate([quads, quads + 3600]))
    program.patches = Patches(1)
    program.patches.become(mesh, 0.01, mesh.points_m[:, 0] > -0.04)
    program.axes = "mat"
    program.scan, program.activity = ScanState(words="go on", level="good"), Activity.SCANNING
    page = opened("scan")
    page.wait_for_function("() => +document.getElementById('scan-model').dataset.parts > 0")
    page.wait_for_function("() => document.getElementById('scan-model').dataset.drawn")
    page.wait_for_timeout(500)
    picture = cv2.imdecode(np.frombuffer(page.locator("#scan-model").screenshot(), np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    blue, green, red = (picture[..., channel].astype(int) for channel in range(3))
    rows_of_post = np.flatnonzero(((red > 90) & (blue < 60) & (green < 60))[:, 80:-80].any(axis=1))
    rows_of_plate = np.flatnonzero(((blue > 90) & (red < 60) & (green < 60)).any(axis=1))
    assert len(rows_of_post) > 20
    assert rows_of_post.min() < rows_of_plate.min() - 10
    assert rows_of_post.max() < rows_of_plate.max()
    assert page.text_content("#scan-hatch:not([hidden])") == "Hatched surface was never in view: its shape is a guess."
    hatched = ((blue > red + 30) & (red > 70) & (green > 70))[rows_of_plate.min() : rows_of_plate.max()]
    half = hatched.shape[1] // 2
    assert hatched[:, 80:half].sum() > 100 + 10 * hatched[:, half:-80].sum()
