"""Other programs read our recordings: mcap with mcap-ros2-support, rosbags, and Rerun, in an environment of their own."""

import dataclasses
import json
import os
import re
import subprocess
import sysconfig
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from common.frame import PixelFormat
from common.recording.layout import ABOUT, CLOCK, CLOUD, DELAYS, DEPTH, About, camera_info_topic, image_topic, topics
from common.recording.recording_file import RecordingFile
from common.recording.ros_messages import (
    POINT_BYTES,
    RecordedImage,
    camera_info_message,
    cloud_parts,
    depth_parts,
    image_message,
    image_type,
)
from phone_host.recording.recorder import camera_infos
from phone_host.run.recording_sinks import cloud_data
from phone_host.stereo.rectify import rectify_rig
from phone_host.sync.clock import ClockEstimate
from tests.docs.commands import ROOT
from tests.support.recorded import PERIOD_NS, ZERO_NS, payload
from tests.support.rigs import unlike_rig
from tests.support.samples import LEDGER

ORACLES = ROOT / "build" / "oracles" / "bin" / "python"
RERUN = ORACLES.with_name("rerun")
SCRIPT = ROOT / "tests" / "support" / "read_by_others.py"


def _recording(folder: Path) -> tuple[Path, list[float]]:
    """A recording with each kind of message; and P of its right camera."""
    path, rig = folder / "s.mcap", unlike_rig()
    file = RecordingFile(path)
    file.tell(ABOUT, About(unix_ns=5).values())
    file.attach("rig.yaml", "text/yaml", b"a: 1\n", ZERO_NS)
    infos = camera_infos(rig, rectify_rig(rig), ZERO_NS)
    for side, info in infos:
        data = camera_info_message(info)
        file.add(camera_info_topic(side.value), data, sequence=0, log_ns=ZERO_NS, publish_ns=ZERO_NS)
    forms = (PixelFormat.MJPEG, PixelFormat.PNG, PixelFormat.GREY, PixelFormat.YUYV)
    for number, form in enumerate(forms):
        at_ns = ZERO_NS + number * PERIOD_NS
        size = {PixelFormat.GREY: 12, PixelFormat.YUYV: 24}.get(form)
        image = RecordedImage(at_ns, "left", form, (4, 3), payload(number) if size is None else bytes(size))
        topic = image_topic("left", image_type(form))
        file.add(topic, image_message(image), sequence=number, log_ns=at_ns, publish_ns=at_ns)
    for topic in (DELAYS, CLOCK):
        file.add(topic, b'{"capture_ns":3}', sequence=0, log_ns=ZERO_NS, publish_ns=ZERO_NS)
    data = cloud_data(np.full((2, 3, 3), 0.5, np.float32), np.full((2, 3, 3), 9, np.uint8))
    for topic, parts in (
        (DEPTH, depth_parts(ZERO_NS, "left", (3, 2), bytes(12))),
        (CLOUD, cloud_parts(ZERO_NS, "left", data)),
    ):
        file.add(topic, *parts, sequence=0, log_ns=ZERO_NS, publish_ns=ZERO_NS)
    file.close()
    return path, list(infos[1][1].projection)


@pytest.mark.skipif(not ORACLES.exists(), reason="other programs' readers are not installed: make oracles")
def test_other_programs_read_every_topic(tmp_path: Path) -> None:
    """Each message with its stamp and frame, checksums and summary right; written again by rosbags it has our bytes."""
    path, projection = _recording(tmp_path)
    ended = subprocess.run([ORACLES, SCRIPT, path], capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 0, ended.stderr
    read = json.loads(ended.stdout)
    by_mcap, by_rosbags = read["mcap"], read["rosbags"]
    assert by_mcap["/left/image/compressed"] == [[ZERO_NS + n * PERIOD_NS, "left", len(payload(n))] for n in (0, 1)]
    assert [one[2] for one in by_mcap["/left/image"]] == [12, 24]
    assert by_mcap["/right/camera_info"] == [[ZERO_NS, "right", projection]]
    assert by_mcap["/right/camera_info"][0][2][3] < 0, "-f b"
    assert by_mcap[DELAYS] == by_mcap[CLOCK] == [["capture_ns"]]
    assert (by_mcap["attachments"], by_mcap["metadata"]) == (["rig.yaml"], ["channels", "tandemscan"])
    assert (by_mcap[DEPTH], by_mcap[CLOUD]) == ([[ZERO_NS, "left", 12]], [[ZERO_NS, "left", 6 * POINT_BYTES]])
    counts = {"/left/image/compressed": 2, "/left/image": 2, "/left/camera_info": 1, "/right/camera_info": 1}
    counts |= {DEPTH: 1, CLOUD: 1}
    assert {topic: len(messages) for topic, messages in by_rosbags.items()} == counts
    assert all(is_same for messages in by_rosbags.values() for _, is_same in messages)


@pytest.mark.skipif(not RERUN.exists(), reason="Rerun is not installed: make oracles")
def test_rerun_opens_a_recording_and_our_example_shows_it(tmp_path: Path) -> None:
    """Rerun's own reader finds nothing wrong with any topic and takes all of them; what the example saves is whole, with the images of both kinds that are encoded."""
    path, _ = _recording(tmp_path)
    judged = _said(RERUN, "mcap", "check", "--full", path)
    converted, shown = tmp_path / "converted.rrd", tmp_path / "shown.rrd"
    _said(RERUN, "mcap", "convert", path, "-o", converted)
    held = _said(RERUN, "rrd", "stats", converted)
    for topic in ("/left/image/compressed", "/left/image", "/right/camera_info", DEPTH, CLOUD, DELAYS, CLOCK):
        assert re.search(rf"ok +\d+ +\d+ +{topic} ", judged), topic
        assert f"{topic}: " in held
    ours = {"PYTHONPATH": f"{ROOT}:{sysconfig.get_path('purelib')}"}
    _said(ORACLES, ROOT / "examples" / "show_in_rerun.py", path, shown, more=ours)
    _said(RERUN, "rrd", "verify", shown)
    assert "/left/image/compressed: " in _said(RERUN, "rrd", "stats", shown)


def _said(*words: "str | Path", more: Mapping[str, str] = MappingProxyType({})) -> str:
    """What a command prints that must end well."""
    ended = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False, env={**os.environ, **more})
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def test_the_layout_for_foxglove_names_what_a_recording_holds() -> None:
    """Its topics, and the fields of those that are JSON."""
    layout = json.loads((ROOT / "examples" / "foxglove-layout.json").read_text())
    names = {topic.name for topic in topics()}
    fields = {
        DELAYS: set(json.loads(LEDGER.to_json())),
        CLOCK: {field.name for field in dataclasses.fields(ClockEstimate)},
    }
    seen = []
    for panel in layout["configById"].values():
        seen += list(panel.get("imageMode", {}).values())
        for plotted in panel.get("paths", []):
            topic, _, field = plotted["value"].partition(".")
            assert field in fields[topic]
            seen.append(topic)
    assert {"/left/image/compressed", "/right/image/compressed", DELAYS, CLOCK} <= set(seen) <= names
