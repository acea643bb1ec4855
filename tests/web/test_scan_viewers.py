"""The scan's step for several viewers and small screens: the running scan's options, its command, what is in view, and how Stop looks."""

import numpy as np
import pytest

from phone_host.scan.mesh import Mesh
from phone_host.scan.patches import Patches
from phone_host.web.source import Activity, ScanState
from tests.web.conftest import LAPTOP, PHONE, Complaints, Opener
from tests.web.played import Played, guide_snapshot

MODES = [
    ({"mat": "usual"}, "mat", "--mat"),
    ({"mat": "8x6:30mm:22mm:4x4"}, "mat", "--mat 8x6:30mm:22mm:4x4"),
    ({"turntable": "yes", "voxel": "2mm"}, "turntable", "--voxel 2mm --turntable"),
    ({"object": "yes", "box": "300x300x200@0,0,600"}, "object", "--box 300x300x200@0,0,600 --object"),
    ({"mat": "usual", "unseen": "cut"}, "mat", "--mat --unseen cut"),
]
CAMERAS = {"link": "tcp://192.168.7.2:5555", "camera": "v4l2:/dev/video0"}
CALIBRATED = {**CAMERAS, "calibration": "rig.yaml"}


@pytest.mark.parametrize("mode", MODES)
def test_every_viewer_shows_the_options_and_the_command_of_the_running_scan(
    program: Played, opened: Opener, complaints: Complaints, mode: tuple[dict[str, str], str, str]
) -> None:
    """A viewer that did not start the scan shows its kind, detail, mat and box, cannot change what is fixed, and the card shows `scan` with these options."""
    options, kind, words = mode
    program.patches, program.activity, program.settings = Patches(1), Activity.SCANNING, CALIBRATED
    order = ("voxel", "box", "mat", "turntable", "object", "unseen")
    program.scan = ScanState(words="go on", level="good", options={name: options.get(name, "") for name in order})
    page = opened("scan")
    page.wait_for_function("kind => document.getElementById('scan-kind').value === kind", arg=kind)
    assert page.is_disabled("#scan-kind")
    assert page.is_disabled("#scan-voxel")
    assert page.input_value("#scan-voxel") == options.get("voxel", "")
    assert page.is_disabled("#scan-unseen")
    assert page.input_value("#scan-unseen") == options.get("unseen", "fill")
    assert page.input_value("#scan-box") == options.get("box", "")
    assert page.is_visible("#scan-mat") is ("8x6" in options.get("mat", ""))  # the default one needs no field any more
    page.wait_for_function("words => document.getElementById('command').textContent.endsWith(' ' + words)", arg=words)
    assert page.text_content("#command").startswith("phone-host scan --calibration rig.yaml --camera")
    assert complaints == []


def test_the_command_follows_step_and_choices(program: Played, opened: Opener) -> None:
    """On the scan's step it is `scan` with what is chosen there, on others `run`; a value that a shell would read is quoted; before cameras and calibration are chosen a sentence stands there."""
    program.patches = Patches(1)
    page = opened("scan")
    said = "words => document.getElementById('command').textContent === `Command: appears once ${words}`"
    page.wait_for_function(said, arg="board and camera are chosen")
    program.change(settings=CAMERAS)
    page.wait_for_function(said, arg="the cameras are calibrated")
    assert page.get_attribute("#command-copy", "aria-disabled") == "true"
    program.change(settings=CALIBRATED)
    page.wait_for_function("() => document.getElementById('command').textContent.startsWith('phone-host scan')")
    page.select_option("#scan-kind", "object")
    page.fill("#scan-voxel", "2 mm; ls")
    assert page.text_content("#command").endswith(" --voxel '2 mm; ls' --object")
    page.evaluate("() => { location.hash = 'run'; }")
    page.wait_for_function("() => document.getElementById('command').textContent.startsWith('phone-host run')")


def test_a_box_that_another_viewer_sets_is_shown(program: Played, opened: Opener) -> None:
    """The box may be changed while a scan goes on; all viewers see the same one."""
    program.patches, program.activity = Patches(1), Activity.SCANNING
    program.scan = ScanState(words="go on", level="good", options={"box": ""})
    page = opened("scan")
    page.wait_for_selector("#scan-kind:disabled")
    program.change(scan=ScanState(words="go on", level="good", options={"box": "100x100x100@0,0,500"}))
    page.wait_for_function("() => document.getElementById('scan-box').value === '100x100x100@0,0,500'")


def test_a_phone_shows_the_surface_without_scrolling(program: Played, opened: Opener) -> None:
    """At 390 px most of the surface's picture stands above the fold of a scan on the mat whose depth was judged; its choices of colours and shape are whole, and each kind's words fit their field."""
    program.patches, program.activity = Patches(1), Activity.SCANNING
    program.scan = ScanState(
        words="3 pairs in the model: go on", level="good", pairs=3, fused=3, options={"mat": "usual"}
    )
    program.emit()
    page = opened("scan", PHONE)
    page.wait_for_selector("#scan-kind:disabled")
    page.wait_for_selector("#trust[data-level=good]")
    assert page.inner_text("#scan-state") == "3 pairs in the model: go on."
    frame = page.locator("#panel-scan .turning").bounding_box()
    assert frame["y"] + 0.75 * frame["height"] <= PHONE["height"]
    box = page.locator("#panel-scan .segments").bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= PHONE["width"]
    wide = page.evaluate(
        """() => { const select = document.getElementById('scan-kind'), pen = document.createElement('canvas').getContext('2d');
        pen.font = getComputedStyle(select).font;
        return [Math.max(...[...select.options].map((one) => pen.measureText(one.text).width)), select.clientWidth]; }"""
    )
    assert wide[0] + 40 <= wide[1]


@pytest.mark.parametrize("size", [PHONE, LAPTOP], ids=["phone", "laptop"])
def test_stop_looks_the_same_on_every_step(program: Played, opened: Opener, size: dict[str, int]) -> None:
    """Colour, border and ground of Stop are those of the run's wherever something can be stopped."""
    program.patches, program.guide = Patches(1), guide_snapshot()
    page = opened("run", size)
    looks = {}
    for step, activity, button in (
        ("run", Activity.RUNNING, "go"),
        ("scan", Activity.SCANNING, "scan-go"),
        ("calibration", Activity.CALIBRATING, "calibrate-go"),
    ):
        page.evaluate("step => { location.hash = step; }", step)
        program.change(activity=activity)
        page.wait_for_function("id => document.getElementById(id).textContent === 'Stop'", arg=button)
        page.mouse.move(0, 0)
        looks[step] = page.evaluate(
            "id => { const s = getComputedStyle(document.getElementById(id)); return [s.color, s.backgroundColor, s.borderColor, s.fontWeight]; }",
            button,
        )
    assert looks["scan"] == looks["run"] == looks["calibration"]


def test_the_sentence_about_hatching_goes_with_the_surface(program: Played, opened: Opener) -> None:
    """It stands under surface that was never in view; when the next scan begins, the viewer is empty and the sentence gone, also while the answer with the first patches is lost on its way."""
    points = np.array([[0, 0, 0.5], [0.1, 0, 0.5], [0, 0.1, 0.5]], np.float32)
    mesh = Mesh(points, np.full((3, 3), 90, np.uint8), np.array([[0, 1, 2]], np.int32))
    program.patches = Patches(1)
    program.patches.become(mesh, 0.01, np.zeros(3, np.bool_))
    program.scan = ScanState(words="done", level="good")
    page = opened("scan")
    page.wait_for_selector("#scan-hatch:not([hidden])")
    page.route("**/api/surface?since=0", lambda route: route.abort())
    program.patches = Patches(1)
    program.change(begun=program.begun + 1, activity=Activity.SCANNING)
    page.wait_for_selector("#scan-none:not([hidden])")
    page.wait_for_selector("#scan-hatch", state="hidden")
