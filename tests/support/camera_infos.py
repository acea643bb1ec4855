"""Reads what a recording says of a camera with rosbags: another program's reader is the judge of what ours writes."""

from typing import Any

import pytest

from common.recording.ros_messages import CAMERA_INFO, NS, CameraInfo


def read_camera_info(data: bytes | memoryview) -> CameraInfo:
    """Read a message `sensor_msgs/msg/CameraInfo`."""
    types: Any = pytest.importorskip("rosbags.typesys", reason="the extra recordings is not installed")
    read = types.get_typestore(types.Stores.ROS2_HUMBLE).deserialize_cdr(data, CAMERA_INFO)
    return CameraInfo(
        stamp_ns=read.header.stamp.sec * NS + read.header.stamp.nanosec,
        frame_id=read.header.frame_id,
        size_px=(read.width, read.height),
        model=read.distortion_model,
        distortion=tuple(read.d),
        matrix=tuple(read.k),
        rotation=tuple(read.r),
        projection=tuple(read.p),
    )
