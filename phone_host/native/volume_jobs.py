"""The jobs of the native library that concern a volume, as src/tandem.h declares them; `library` runs them."""

import ctypes
from typing import Any

POINTER = ctypes.c_void_p
INT = ctypes.c_int32
INT64 = ctypes.c_int64
FLOAT = ctypes.c_float
_POSE = ctypes.c_float * 12


def each(kind: type[Any], names: str) -> tuple[tuple[str, type[Any]], ...]:
    """Return fields of one kind, in the order of their names, which blanks part."""
    return tuple((name, kind) for name in names.split())


_CAMERA = (
    *each(INT, "width height"),
    *each(FLOAT, "focal_px cx_px cy_px"),
)


class VolumeArrays(ctypes.Structure):
    """`struct tandem_volume`."""

    _fields_ = (
        *each(POINTER, "slots places field weights colours"),
        ("slot_count", INT64),
        *each(INT, "room count"),
        *each(FLOAT, "voxel_m truncation_m"),
    )


class TouchJob(ctypes.Structure):
    """`struct tandem_touch_job`."""

    _fields_ = (
        ("volume", ctypes.POINTER(VolumeArrays)),
        ("depth_m", POINTER),
        ("world_camera", _POSE),
        *_CAMERA,
        ("far_m", FLOAT),
        *each(INT, "step reserved"),
        ("missing", INT64),
    )


class FuseJob(ctypes.Structure):
    """`struct tandem_fuse_job`."""

    _fields_ = (
        ("volume", ctypes.POINTER(VolumeArrays)),
        *each(POINTER, "depth_m colours changed"),
        ("camera_world", _POSE),
        *_CAMERA,
        *each(FLOAT, "far_m noise_per_m sure_m weight_one"),
        *each(INT, "most_weight threads reserved"),
    )


class CarveJob(ctypes.Structure):
    """`struct tandem_carve_job`."""

    _fields_ = (
        *each(POINTER, "looked_through hidden blank depth_m"),
        ("camera_world", _POSE),
        ("counts", INT * 3),
        ("low_m", FLOAT * 3),
        ("cell_m", FLOAT),
        *_CAMERA,
        *each(FLOAT, "noise_per_m sigmas clear_m"),
        ("threads", INT),
    )


class CastJob(ctypes.Structure):
    """`struct tandem_cast_job`."""

    _fields_ = (
        ("volume", ctypes.POINTER(VolumeArrays)),
        *each(POINTER, "seeds_m points_m normals"),
        ("world_camera", _POSE),
        *_CAMERA,
        *each(FLOAT, "near_m far_m"),
        *each(INT, "search threads reserved"),
    )


class RegisterJob(ctypes.Structure):
    """`struct tandem_register_job`."""

    _fields_ = (
        *each(POINTER, "depth_m points_m normals sums"),
        ("model_camera", _POSE),
        *_CAMERA,
        *each(FLOAT, "most_m floor_m noise_per_m huber_sigmas"),
        *each(INT, "step threads reserved"),
    )


class AbsorbJob(ctypes.Structure):
    """`struct tandem_absorb_job`."""

    _fields_ = (
        *each(ctypes.POINTER(VolumeArrays), "into of"),
        ("chosen", POINTER),
        ("of_into", ctypes.c_double * 12),
        *each(INT, "most_weight threads"),
    )
