"""The host's half of bench_browser, a process of its own so that its CPU time is known: `python -m tests.bench.browser_host URI SECONDS`.

Prints the page's address, and after the film one JSON object: each frame's number, stamp, uncertainty and bound, ns; CPU time a
frame, ms; what was dropped, by reason.
"""

import json
import sys
import time
from typing import Final

from common import now
from common.frame import Frame
from common.stamp import HOST_CLOCK
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.camera.factory import open_camera
from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from phone_host.web.source import StepName
from tests.support.numbered_film import number_in
from tests.web.played import Played

_PATIENCE_NS: Final = 60_000_000_000
_TICK_S: Final = 0.005


def main(uri: str, seconds: float) -> None:
    """Serve the page, and take the camera's frames as a run does."""
    feed = BrowserFeed(_PATIENCE_NS)
    program = Played((), settings={"camera": uri}, done={StepName.BOARD}, feed=feed)
    server = PageServer(program, PageSettings(port=0, token="only-for-this-bench"))
    server.start()
    print(server.url, flush=True)
    camera = open_camera(uri, HOST_CLOCK, now.monotonic_ns(), feed=feed)
    frames: list[Frame] = []
    until, used_s = time.monotonic() + seconds, time.process_time()
    while time.monotonic() < until:
        time.sleep(_TICK_S)
        frames += [grab for grab in camera.read(now.monotonic_ns()) if isinstance(grab, Frame)]
    used_s = time.process_time() - used_s
    health = camera.health
    camera.close()
    server.stop()
    print(
        json.dumps(
            {
                "frames": [[number_in(each), each.exposed.ns, each.uncertainty_ns, each.bound_ns] for each in frames],
                "cpu_ms": used_s / len(frames) * 1e3 if frames else None,
                "dropped": {fault.value: count for fault, count in health.faults},
                "missed": health.missed,
                "epoch": None if health.origin is None else health.origin.epoch,
            }
        )
    )


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
