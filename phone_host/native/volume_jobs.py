"""The jobs of the native library that concern a volume, as src/tandem.h declares them; `library` runs them."""

import ctypes

_POINTER = ctypes.c_void_p
_INT = ctypes.c_int32
_FLOAT = ctypes.c_float
_POSE = ctypes.c_float * 12
_CAMERA = (
    ("width", _INT),
    ("height", _INT),
    ("focal_px", _FLOAT),
    ("cx_px", _FLOAT),
    ("cy_px", _FLOAT),
)


class VolumeArrays(ctypes.Structure):
    """`struct tandem_volume`."""

    _fields_ = (
        ("slots", _POINTER),
        ("places", _POINTER),
        ("field", _POINTER),
        ("weights", _POINTER),
        ("colours", _POINTER),
        ("slot_count", ctypes.c_int64),
        ("room", _INT),
        ("count", _INT),
        ("voxel_m", _FLOAT),
        ("truncation_m", _FLOAT),
    )


class TouchJob(ctypes.Structure):
    """`struct tandem_touch_job`."""

    _fields_ = (
        ("volume", ctypes.POINTER(VolumeArrays)),
        ("depth_m", _POINTER),
        ("world_camera", _POSE),
        *_CAMERA,
        ("far_m", _FLOAT),
        ("step", _INT),
        ("reserved", _INT),
        ("missing", ctypes.c_int64),
    )


class FuseJob(ctypes.Structure):
    """`struct tandem_fuse_job`."""

    _fields_ = (
        ("volume", ctypes.POINTER(VolumeArrays)),
        ("depth_m", _POINTER),
        ("colours", _POINTER),
        ("changed", _POINTER),
        ("camera_world", _POSE),
        *_CAMERA,
        ("far_m", _FLOAT),
        ("noise_per_m", _FLOAT),
        ("sure_m", _FLOAT),
        ("weight_one", _FLOAT),
        ("most_weight", _INT),
        ("threads", _INT),
        ("reserved", _INT),
    )


class CarveJob(ctypes.Structure):
    """`struct tandem_carve_job`."""

    _fields_ = (
        ("looked_through", _POINTER),
        ("hidden", _POINTER),
        ("blank", _POINTER),
        ("depth_m", _POINTER),
        ("camera_world", _POSE),
        ("counts", _INT * 3),
        ("low_m", _FLOAT * 3),
        ("cell_m", _FLOAT),
        *_CAMERA,
        ("noise_per_m", _FLOAT),
        ("sigmas", _FLOAT),
        ("clear_m", _FLOAT),
        ("threads", _INT),
    )


class CastJob(ctypes.Structure):
    """`struct tandem_cast_job`."""

    _fields_ = (
        ("volume", ctypes.POINTER(VolumeArrays)),
        ("seeds_m", _POINTER),
        ("points_m", _POINTER),
        ("normals", _POINTER),
        ("world_camera", _POSE),
        *_CAMERA,
        ("near_m", _FLOAT),
        ("far_m", _FLOAT),
        ("search", _INT),
        ("threads", _INT),
        ("reserved", _INT),
    )


class RegisterJob(ctypes.Structure):
    """`struct tandem_register_job`."""

    _fields_ = (
        ("depth_m", _POINTER),
        ("points_m", _POINTER),
        ("normals", _POINTER),
        ("sums", _POINTER),
        ("model_camera", _POSE),
        *_CAMERA,
        ("most_m", _FLOAT),
        ("floor_m", _FLOAT),
        ("noise_per_m", _FLOAT),
        ("huber_sigmas", _FLOAT),
        ("step", _INT),
        ("threads", _INT),
        ("reserved", _INT),
    )


class AbsorbJob(ctypes.Structure):
    """`struct tandem_absorb_job`."""

    _fields_ = (
        ("into", ctypes.POINTER(VolumeArrays)),
        ("of", ctypes.POINTER(VolumeArrays)),
        ("chosen", _POINTER),
        ("of_into", ctypes.c_double * 12),
        ("most_weight", _INT),
        ("threads", _INT),
    )


def declare(handle: ctypes.CDLL) -> None:
    """State the arguments and results of these functions."""
    handle.tandem_fuse.argtypes = [_INT, ctypes.POINTER(FuseJob)]
    handle.tandem_carve.argtypes = [_INT, ctypes.POINTER(CarveJob)]
    handle.tandem_cast.argtypes = [_INT, ctypes.POINTER(CastJob)]
    handle.tandem_touch.argtypes = [ctypes.POINTER(TouchJob)]
    handle.tandem_register.argtypes = [ctypes.POINTER(RegisterJob)]
    handle.tandem_absorb.argtypes = [ctypes.POINTER(AbsorbJob)]
    for name in ("fuse", "carve", "cast", "touch", "register", "absorb"):
        getattr(handle, f"tandem_{name}").restype = _INT
