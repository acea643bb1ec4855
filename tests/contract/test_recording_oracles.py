"""Other programs read our recordings: mcap with mcap-ros2-support, and rosbags, in an environment of their own."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from common.frame import PixelFormat
from common.recording.layout import ABOUT, CLOCK, CLOUD, DELAYS, DEPTH, About, camera_info_topic, image_topic
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
from phone_host.recording.begin import camera_infos
from phone_host.recording.computed import cloud_data
from phone_host.stereo.rectify import rectify_rig
from tests.docs.commands import ROOT
from tests.support.recorded import PERIOD_NS, ZERO_NS, payload
from tests.support.rigs import unlike_rig

ORACLES = ROOT / "build" / "oracles" / "bin" / "python"
SCRIPT = ROOT / "tests" / "support" / "read_by_others.py"


@pytest.mark.skipif(not ORACLES.exists(), reason="other programs' readers are not installed: make oracles")
def test_other_programs_read_every_topic(tmp_path: Path) -> None:
    """Each message with its stamp and frame, checksums and summary right; written again by rosbags it has our bytes."""
    path, rig = tmp_path / "s.mcap", unlike_rig()
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
    ended = subprocess.run([ORACLES, SCRIPT, path], capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 0, ended.stderr
    read = json.loads(ended.stdout)
    by_mcap, by_rosbags = read["mcap"], read["rosbags"]
    assert by_mcap["/left/image/compressed"] == [[ZERO_NS + n * PERIOD_NS, "left", len(payload(n))] for n in (0, 1)]
    assert [one[2] for one in by_mcap["/left/image"]] == [12, 24]
    assert by_mcap["/right/camera_info"] == [[ZERO_NS, "right", list(infos[1][1].projection)]]
    assert by_mcap["/right/camera_info"][0][2][3] < 0, "-f b"
    assert by_mcap[DELAYS] == by_mcap[CLOCK] == [["capture_ns"]]
    assert (by_mcap["attachments"], by_mcap["metadata"]) == (["rig.yaml"], ["channels", "tandemscan"])
    assert (by_mcap[DEPTH], by_mcap[CLOUD]) == ([[ZERO_NS, "left", 12]], [[ZERO_NS, "left", 6 * POINT_BYTES]])
    counts = {"/left/image/compressed": 2, "/left/image": 2, "/left/camera_info": 1, "/right/camera_info": 1}
    counts |= {DEPTH: 1, CLOUD: 1}
    assert {topic: len(messages) for topic, messages in by_rosbags.items()} == counts
    assert all(is_same for messages in by_rosbags.values() for _, is_same in messages)
