"""Depth and clouds in a recording: what they hold, how often, and only if asked for."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.errors import SettingsError
from common.ledger import StageTimes
from common.recording.inflate import inflate
from common.recording.layout import CLOUD, DEPTH
from common.recording.mcap_records import Message
from common.recording.opened import open_recorded, stored_data
from common.recording.ros_messages import IMAGE, POINT_BYTES, POINT_CLOUD
from common.recording.salvage import Salvage
from phone_host.jobs.run_request import checked
from phone_host.model import FramePair, Processed, RectifiedPair, Result, Side
from phone_host.recording.recorder import begin_recording
from phone_host.recording.switch import RecordingSwitch
from phone_host.run.recording_sinks import Computed, ComputedSink, cloud_data
from tests.support.programs import until
from tests.support.recorded import own_frame, payload
from tests.support.requests import request_of
from tests.support.samples import CAMERA, LEDGER

_CAMERA = replace(CAMERA, width_px=32, height_px=24)
_NAN = np.nan
_CLOUD_M = np.array([[[0.1, 0.2, 1.5], [_NAN, _NAN, _NAN]], [[-0.3, 0.0, 2.25], [0.0, 0.0, 0.75]]], np.float32)
_DEPTH_MM = [[1500, 0], [2250, 750]]
_COLOURS = np.array([[[1, 2, 3], [0, 0, 0]], [[4, 5, 6], [7, 8, 9]]], np.uint8)


def _result(at_ns: int, cloud: "np.ndarray[tuple[int, ...], np.dtype[np.float32]] | None" = _CLOUD_M) -> Result:
    pair = RectifiedPair(_COLOURS, _COLOURS)
    frames = FramePair.__new__(FramePair)  # no frame is looked at
    return Result(0, frames, Processed(pair, None, cloud, StageTimes()), replace(LEDGER, done_ns=at_ns))


def _messages(path: Path, topic: str) -> list[Message]:
    records = Salvage(stored_data(path), inflate).records()
    return [each for each in records if isinstance(each, Message) and each.channel and each.channel.topic == topic]


def test_points_and_their_colours() -> None:
    """Those that are there, in rows; red, green and blue in the bytes of one number; grey is all three."""
    points = np.frombuffer(cloud_data(_CLOUD_M, _COLOURS), "<f4").reshape(-1, 4)
    assert np.array_equal(points[:, :3], _CLOUD_M[~np.isnan(_CLOUD_M[..., 2])])
    assert [hex(each) for each in points[:, 3].copy().view("<u4")] == ["0x30201", "0x60504", "0x90807"]
    grey = np.frombuffer(cloud_data(_CLOUD_M, _COLOURS[..., 0]), "<f4").reshape(-1, 4)
    assert [hex(each) for each in grey[:, 3].copy().view("<u4")] == ["0x10101", "0x40404", "0x70707"]
    assert cloud_data(np.full((1, 2, 3), _NAN, np.float32), _COLOURS[:1]) == b""


def test_depth_and_cloud_are_recorded_once_a_second(tmp_path: Path) -> None:
    """Of results at 0, 0.4, 1.0 and 1.9 s the first and the third; nothing before the recording begins; a reader of ours passes them over."""
    path = tmp_path / "s.mcap"
    switch = RecordingSwitch(lambda file: begin_recording(file, _CAMERA, Side.LEFT))
    sink = ComputedSink(switch, {Computed.DEPTH, Computed.CLOUD}, Side.LEFT)
    sink.offer(_result(0))
    switch.begin(path)
    switch.own_frame(own_frame(0, payload(0), 10**9))
    for at_ms in (5000, 5400, 6000, 6900):
        sink.offer(_result(at_ms * 1_000_000))
        until(lambda: not sink.accounts[0].waiting, "it is taken")
    sink.offer(_result(9_000_000_000, None))  # without geometry there are no metres
    sink.finish()
    switch.end()
    depths, clouds = _messages(path, DEPTH), _messages(path, CLOUD)
    assert (len(depths), len(clouds)) == (2, 2)
    assert np.frombuffer(depths[0].data[-8:], "<u2").reshape(2, 2).tolist() == _DEPTH_MM
    assert bytes(clouds[0].data[-1 - 3 * POINT_BYTES : -1]) == cloud_data(_CLOUD_M, _COLOURS)
    assert [each.channel.kind for each in (depths[0], clouds[0]) if each.channel] == [IMAGE, POINT_CLOUD]
    found = open_recorded(path)
    assert (list(found.images), found.damages) == (["/right/image/compressed"], [])


@pytest.mark.parametrize(
    ("names", "record", "problem"), [("depth", None, "without --record"), ("depth,disparity", Path("s"), "depth,cloud")]
)
def test_wrong_names_are_refused(names: str, record: Path | None, problem: str) -> None:
    """One line that says what there is."""
    with pytest.raises(SettingsError) as refused:
        checked(request_of("run", "--record-topics", names, *(() if record is None else ("--record", str(record)))))
    assert problem in str(refused.value)
    assert request_of("run", "--record-topics", "cloud, depth", "--record", "s").record_topics == set(Computed)
    assert request_of("run").record_topics is None
