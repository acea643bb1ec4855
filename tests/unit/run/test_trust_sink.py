"""A run's images are judged twice a second, beside the pairs: none waits for it, and no judgement is the last one by mistake."""

import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from types import FrameType
from typing import Final

import numpy as np
import pytest

from common import now
from phone_host.diagnostics.codes import BLOCKING, Code
from phone_host.diagnostics.headline import Grade, answer
from phone_host.model import Epipolar, Image, Processed, RectifiedPair, Result, Rig, StereoGeometry
from phone_host.run.sinks import SinkQueue
from phone_host.run.trust_sink import TrustSink
from phone_host.scene.scene import demo_scene, unlike_rig
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.rectifier import Rectifier
from tests.support.results import result
from tests.support.rigs import small_rig, stacked_rig

_PATIENCE_S: Final = 60.0
_PERIOD_NS: Final = 500_000_000

Pair = tuple[Image, Image]


def _views(rig: Rig) -> Pair:
    left, right = (
        render(demo_scene(), model, pose) for model, pose in zip((rig.left, rig.right), rig_poses(rig), strict=True)
    )
    return left, right


@pytest.fixture(scope="module")
def core() -> StereoCore:
    """The demo's rig, 320x240, whose calibration says so."""
    return StereoCore(MatchSettings(disparities=48), Rectifier(small_rig()))


@pytest.fixture(scope="module")
def good(core: StereoCore) -> Processed:
    """What its cameras see."""
    return core.compute(*_views(small_rig()), lambda: 0)


def _result(processed: Processed) -> Result:
    return replace(result(0), processed=processed)


class _Run:
    """A sink, and its clock: a run whose pairs come when the test says."""

    def __init__(self, core: StereoCore | None) -> None:
        self.now_ns = 0
        self.sink = TrustSink(core, lambda: self.now_ns)

    def pair(self, processed: Processed, at_ns: int) -> None:
        self.now_ns = at_ns
        self.sink.offer(_result(processed))

    def await_judged(self, number: int) -> None:
        _until(lambda: self.sink.trust.judged >= number)


def _until(holds: Callable[[], bool]) -> None:
    """Look again and again until it holds; fail if it never does."""
    end_ns = now.monotonic_ns() + round(_PATIENCE_S * 1e9)
    pause = threading.Event()
    while not holds():
        assert now.monotonic_ns() < end_ns, "it never held"
        pause.wait(0.001)


@pytest.fixture
def run(core: StereoCore) -> Iterator[_Run]:
    """A run of that rig."""
    made = _Run(core)
    yield made
    made.sink.finish()


def test_of_ten_pairs_a_second_two_are_judged(run: _Run, good: Processed) -> None:
    """Pairs every 100 ms for 3 s: those at 0, 0.5, ... 2.5 s are judged; the others pass and are not counted as dropped."""
    for number in range(30):
        run.pair(good, number * 100_000_000)
        run.await_judged(number // 5 + 1)
    run.sink.finish()
    assert run.sink.trust.judged == 6
    assert run.sink.accounts[0].dropped == 0


def test_a_run_of_rectified_images_says_that_its_geometry_is_foreign(good: Processed) -> None:
    """KITTI's principal point 602,183 given for images of 287x209 px: the run's trust names it with the first judged pair."""
    geometry = StereoGeometry(focal_px=707.0, baseline_m=0.54, cx_px=602.0, cy_px=183.0)
    run = _Run(StereoCore(MatchSettings(disparities=48), geometry=geometry))
    run.pair(replace(good, geometry=geometry), 0)
    run.sink.finish()
    [told] = [concern for concern in run.sink.trust.concerns if concern.code == Code.GEOMETRY]
    assert "602,183 lies far from the middle of 287x209 px" in told.message


class _Gated(StereoCore):
    """A core that the sink's thread has to wait for."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(MatchSettings(disparities=48), Rectifier(rig))
        self.gate, self.reached = threading.Event(), threading.Event()

    def rectifier_for(self, size_px: tuple[int, int]) -> Rectifier | None:
        self.reached.set()
        assert self.gate.wait(_PATIENCE_S)
        return super().rectifier_for(size_px)


def test_no_pair_waits_for_a_judgement(good: Processed) -> None:
    """While one judgement takes for ever, a hundred due pairs pass; none is kept or counted as dropped."""
    core = _Gated(small_rig())
    run = _Run(core)
    run.pair(good, 0)
    assert core.reached.wait(_PATIENCE_S)
    for number in range(1, 101):
        run.pair(good, number * _PERIOD_NS)
    account = run.sink.accounts[0]
    assert (account.waiting, account.dropped, run.sink.trust.judged) == (1, 0, 0)
    core.gate.set()
    run.sink.finish()
    assert run.sink.trust.judged == 1


def test_a_mistake_stands_after_two_judgements_and_falls_after_two(
    run: _Run, core: StereoCore, good: Processed
) -> None:
    """One judgement of exchanged cameras among good ones names nothing; the second does, within a second of the first. So it goes away again."""
    swapped = core.compute(*_views(small_rig())[::-1], lambda: 0)
    told = []
    for number, processed in enumerate([good, swapped, swapped, good, good]):
        run.pair(processed, number * _PERIOD_NS)
        run.await_judged(number + 1)
        told.append([concern.code for concern in run.sink.trust.concerns if concern.code in BLOCKING])
    assert told == [[], [], [Code.SWAPPED], [Code.SWAPPED], []]


def test_judging_goes_on_however_fast_a_judgement_is() -> None:
    """Each judgement is over before the offer of its pair returns: the next due pair is judged all the same."""
    image = np.zeros((1, 1), np.uint8)
    bare = replace(result(0).processed, pair=RectifiedPair(image, image), disparity=None, cloud=None)
    run = _Run(None)
    offered = 0

    def hold(frame: FrameType, event: str, _: object) -> None:
        if event == "return" and frame.f_code is SinkQueue.offer.__code__:
            run.await_judged(offered)

    sys.setprofile(hold)
    try:
        for offered in range(1, 5):
            run.pair(bare, offered * _PERIOD_NS)
    finally:
        sys.setprofile(None)
    run.sink.finish()
    assert run.sink.trust.judged == 4
    assert run.sink.accounts[0].dropped == 0


def test_a_rig_calibrated_at_twice_the_size_promises_no_more(good: Processed, core: StereoCore) -> None:
    """The headline speaks of the images as they came: calibrated at 640x480, 320x240 have half the focal length in px, and the same depth and error as if calibrated at 320x240."""
    said = []
    scaled = StereoCore(MatchSettings(disparities=48), Rectifier(unlike_rig()))
    for each, processed in ((core, good), (scaled, scaled.compute(*_views(small_rig()), lambda: 0))):
        run = _Run(each)
        run.pair(processed, 0)
        run.sink.finish()
        trust = run.sink.trust
        assert trust.geometry is not None
        assert each.geometry is not None
        said.append((trust.geometry.focal_px, answer(trust.now, (), trust.geometry, trust.disparity_error_px).sentence))
    assert said[1][0] == pytest.approx(said[0][0])
    assert said[1][1] == said[0][1]


@pytest.mark.parametrize("epipolar", [Epipolar.UP, Epipolar.DOWN])
def test_a_run_of_stacked_cameras_is_judged_as_any_other(epipolar: Epipolar) -> None:
    """A good run has no doubt, and its depth looks right."""
    rig = stacked_rig(epipolar)
    core = StereoCore(MatchSettings(disparities=48), Rectifier(rig))
    processed = core.compute(*_views(rig), lambda: 0)
    assert processed.pair.epipolar is epipolar
    run = _Run(core)
    run.pair(processed, 0)
    run.sink.finish()
    trust = run.sink.trust
    assert trust.concerns == ()
    assert trust.has_depth
    assert answer(trust.now, trust.concerns, trust.geometry, trust.disparity_error_px).grade is Grade.GOOD
