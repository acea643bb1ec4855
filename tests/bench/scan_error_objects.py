"""Things on which the stated error of a scan is measured: those of the object benchmark, a plaster bunny, a bottle, a rock, a vase and a castle. And rigs."""

import math
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np

from phone_host.model import CameraModel, Rig
from phone_host.scene.object_scene import LOOKS, ObjectScene, Setting, mat_body, object_rig
from phone_host.scene.scene_model import Body, Box, Frustum, Sphere, Texture, rotation
from phone_host.scene.solid import OBJECTS, Solid

_PLASTER: Final = Texture(
    seed=71, light_bgr=(0.55, 0.56, 0.58), dark_bgr=(0.38, 0.38, 0.40), contrast=0.35, shortest_m=0.0015, longest_m=0.03
)
_GLASS: Final = Texture(
    seed=81, light_bgr=(0.30, 0.55, 0.35), dark_bgr=(0.18, 0.40, 0.22), contrast=0.4, shortest_m=0.003, longest_m=0.05
)
_STONE: Final = Texture(
    seed=95, light_bgr=(0.6, 0.6, 0.6), dark_bgr=(0.2, 0.2, 0.22), contrast=0.9, shortest_m=0.0012, longest_m=0.03
)
_LABEL: Final = Texture(
    seed=82, light_bgr=(0.85, 0.85, 0.85), dark_bgr=(0.3, 0.2, 0.5), contrast=0.8, shortest_m=0.002, longest_m=0.03
)


def _bunny() -> Solid:
    """Round all over, with two thin ears, hardly any texture."""
    return Solid(
        (
            Body("body", Sphere(0.036), (0.0, 0.0, 0.033), _PLASTER),
            Body("head", Sphere(0.024), (0.026, 0.0, 0.072), _PLASTER),
            Body("right ear", Frustum(0.008, 0.005, 0.04), (0.02, 0.012, 0.108), _PLASTER),
            Body("left ear", Frustum(0.008, 0.005, 0.04), (0.02, -0.012, 0.108), _PLASTER),
            Body("tail", Sphere(0.012), (-0.038, 0.0, 0.02), _PLASTER),
        )
    )


def _bottle() -> Solid:
    """The same from all sides but for its label."""
    return Solid(
        (
            Body("low", Frustum(0.033, 0.033, 0.03), (0.0, 0.0, 0.015), _GLASS),
            Body("label", Frustum(0.0331, 0.0331, 0.04), (0.0, 0.0, 0.05), _LABEL),
            Body("high", Frustum(0.033, 0.013, 0.04), (0.0, 0.0, 0.09), _GLASS),
            Body("neck", Frustum(0.013, 0.013, 0.03), (0.0, 0.0, 0.125), _GLASS),
        )
    )


def _rock() -> Solid:
    """Edges, corners and a bulge."""
    return Solid(
        (
            Body("slab", Box((0.07, 0.05, 0.04)), (0.0, 0.0, 0.02), _STONE, rotation((0.0, 0.0, 1.0), 0.4)),
            Body("block", Box((0.045, 0.06, 0.05)), (0.012, 0.004, 0.032), _STONE, rotation((0.0, 0.0, 1.0), 1.1)),
            Body("bulge", Sphere(0.026), (-0.015, -0.01, 0.045), _STONE),
        )
    )


def _vase() -> Solid:
    """Wide above a narrow foot, painted. No constant was fitted to it, nor to the castle."""
    return Solid(
        (
            Body("foot", Frustum(0.026, 0.016, 0.02), (0.0, 0.0, 0.01), _LABEL),
            Body("belly", Frustum(0.016, 0.038, 0.05), (0.0, 0.0, 0.045), _LABEL),
            Body("shoulder", Frustum(0.038, 0.02, 0.03), (0.0, 0.0, 0.085), _LABEL),
        )
    )


def _castle() -> Solid:
    """Towers around a block: edges, gaps and tips."""
    towers = [
        part
        for number, (x, y) in enumerate(((0.032, 0.026), (-0.032, 0.026), (-0.032, -0.026), (0.032, -0.026)))
        for part in (
            Body(f"tower {number}", Frustum(0.013, 0.013, 0.07), (x, y, 0.035), _STONE),
            Body(f"roof {number}", Frustum(0.017, 0.004, 0.02), (x, y, 0.08), _GLASS),
        )
    ]
    return Solid((Body("keep", Box((0.064, 0.052, 0.045)), (0.0, 0.0, 0.0225), _STONE), *towers))


def _wide_rig() -> Rig:
    """Two cameras alike, of fewer pixels, a shorter focal length and a wider baseline."""
    matrix = np.array([[420.0, 0.0, 262.0], [0.0, 420.0, 188.0], [0.0, 0.0, 1.0]])
    camera = CameraModel(
        width_px=520, height_px=390, matrix=matrix, distortion=np.array([-0.1, 0.02, 0.0003, -0.0002, 0.0])
    )
    turn = rotation((0.0, 1.0, 0.1), math.radians(4.0))
    return Rig(left=camera, right=camera, R_right_left=turn, t_right_left_m=-turn @ np.array([0.09, 0.001, 0.0]))


ERROR_OBJECTS: Final = MappingProxyType(
    {**OBJECTS, "bunny": _bunny, "bottle": _bottle, "rock": _rock, "vase": _vase, "castle": _castle}
)
ERROR_RIGS: Final = ("usual", "wide")
"""wide: 520x390 px, f = 420 px, 90 mm apart, sensors of more noise, JPEG 75. No constant was fitted to it."""


def error_scene(name: str, setting: Setting, rig: str = "usual") -> ObjectScene:
    """Return one of them on a table.

    Args:
        name: of `ERROR_OBJECTS`.
        setting: how it is seen.
        rig: of `ERROR_RIGS`; wide brings sensors of its own.
    """
    cameras = object_rig(setting.size)
    if rig == "wide":
        looks = (replace(LOOKS[0], noise_sigma=4.0, blur_px=0.8), replace(LOOKS[1], noise_sigma=3.5, blur_px=0.5))
        cameras, setting = _wide_rig(), replace(setting, looks=looks, jpeg_quality=75)
    return ObjectScene(ERROR_OBJECTS[name](), cameras, setting, mat_body() if setting.has_mat else None)
