"""Poses and cameras in the form in which the native library takes them. Pure."""

import ctypes

import numpy as np

from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.stereo.native.volume_jobs import CarveJob, CastJob, FuseJob, RegisterJob, TouchJob


def rows_of(pose: SE3) -> ctypes.Array[ctypes.c_float]:
    """Return a pose's three rows of rotation and translation, m."""
    rows = np.column_stack([pose.R, pose.t_m]).ravel()
    return (ctypes.c_float * 12)(*rows.tolist())


def aim(
    job: TouchJob | FuseJob | CarveJob | CastJob | RegisterJob, geometry: StereoGeometry, shape: tuple[int, int]
) -> None:
    """Tell a job its camera: geometry, and height and width of the image, px."""
    job.height, job.width = shape
    job.focal_px, job.cx_px, job.cy_px = geometry.focal_px, geometry.cx_px, geometry.cy_px
