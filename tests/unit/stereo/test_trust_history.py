"""A real sink tells which of a run's pairs were taken while a camera was covered, and when."""

import threading
from dataclasses import replace

import numpy as np

from common import now
from phone_host.diagnostics.codes import Code
from phone_host.model import Processed
from phone_host.run.trust_sink import TrustSink
from phone_host.scene.scene import demo_scene
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.rectifier import Rectifier
from tests.support.results import result
from tests.support.rigs import small_rig

_PATIENCE_NS = 60_000_000_000
_SECOND_NS = 1_000_000_000


def test_the_pairs_of_a_cover_are_known_by_number_and_second() -> None:
    """Of pairs a second apart, numbered 0, 10, ... 60, those of 2, 3 and 4 s are covered: 20 to 40, from 2 to 5 s."""
    rig = small_rig()
    core = StereoCore(MatchSettings(disparities=48), Rectifier(rig))
    left, right = (
        render(demo_scene(), model, pose) for model, pose in zip((rig.left, rig.right), rig_poses(rig), strict=True)
    )
    good, covered = core.compute(left, right, lambda: 0), core.compute(left, np.full_like(right, 4), lambda: 0)
    now_ns = 7 * _SECOND_NS  # when the run starts; seconds count from here
    sink = TrustSink(core, lambda: now_ns)
    pairs: list[Processed] = [good, good, covered, covered, covered, good, good]
    for number, processed in enumerate(pairs):
        now_ns = (7 + number) * _SECOND_NS
        sink.offer(replace(result(10 * number), processed=processed))
        _await_judged(sink, number + 1)
    sink.finish()
    trust = sink.trust
    (past,) = trust.history
    assert past.concern.code == Code.COVERED
    assert (past.from_s, past.to_s, past.first_pair, past.last_pair) == (2.0, 5.0, 20, 40)
    assert trust.concerns == trust.newest == ()
    assert trust.now.density > 0.5


def _await_judged(sink: TrustSink, number: int) -> None:
    """Wait until the sink's thread has judged so many pairs."""
    end_ns, pause = now.monotonic_ns() + _PATIENCE_NS, threading.Event()
    while sink.trust.judged < number:
        assert now.monotonic_ns() < end_ns, "it was never judged"
        pause.wait(0.001)
