"""Runs in the guest with the installed package's code: opens a camera without hardware (vivid, v4l2loopback), follows orders, prints what came as JSON.

kernel_camera.py OPTIONS ORDER...
    OPTIONS       of the camera's URI
    frames=N      take N frames
    NAME=VALUE    set the driver's control of that name
    await=FIGURE  go on until this figure of the camera's health is not 0
"""

import json
import select
import sys
import time

sys.path.insert(0, "/usr/lib/tandemscan")

from common.camera.base import Camera, health_values
from common.camera.factory import open_camera
from common.camera.v4l2_device import Device, capture_nodes
from common.frame import Frame

_PATIENCE_S = 120


def read(camera: Camera) -> list[Frame]:
    """Wait as the agent does, for a moment at most; return the sound frames."""
    poller = select.poll()
    if camera.pollable is not None:
        poller.register(camera.pollable, select.POLLIN | select.POLLPRI)
    poller.poll(20)
    return [grab for grab in camera.read(time.monotonic_ns()) if isinstance(grab, Frame)]


def main() -> None:
    """Follow the orders."""
    deadline = time.monotonic() + _PATIENCE_S
    with Device(capture_nodes()[0]) as driver:
        assert driver.identity.driver in {"vivid", "v4l2 loopback"}, driver.identity
        controls = {control.name: control.id for control in driver.controls()}
        camera = open_camera(f"v4l2:{driver.path}?{sys.argv[1]}", "board", time.monotonic_ns())
        frames: list[Frame] = []
        for order in sys.argv[2:]:
            name, _, value = order.partition("=")
            wanted = len(frames) + int(value) if name == "frames" else 0
            if name not in {"frames", "await"}:
                driver.set_control(controls[name], int(value))
            while len(frames) < wanted or (name == "await" and not health_values(camera.health)[value]):
                assert time.monotonic() < deadline, f"{order}: {health_values(camera.health)}"
                frames += read(camera)
        health = health_values(camera.health)
        camera.close()
    last = frames[-1]
    # YUYV has two bytes a pixel, the first of them luma; a JPEG has no rows.
    step = max(1, len(last.payload) // (last.width_px * last.height_px))
    row = last.payload[400 * last.width_px * step : 401 * last.width_px * step : step]
    account = {"format": last.pixel_format.value, "bytes": len(last.payload), "row": list(row), "health": health}
    print(json.dumps({**account, "sequences": [frame.sequence for frame in frames]}))


if __name__ == "__main__":
    main()
