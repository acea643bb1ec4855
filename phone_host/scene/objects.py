"""Things to scan, of known shape: they stand on z = 0 around the z axis, z up, metres. Pure.

What makes a scan hard is one thing at a time: a speckled surface is the easy case, thin parts, a shiny surface and a surface
without texture are not.
"""

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from phone_host.scene.scene_model import Body, Box, Frustum, Sphere, Texture, Torus, rotation
from phone_host.scene.solid import Solid

_UP: Final = (0.0, 0.0, 1.0)


def _speckles(seed: int, light: tuple[float, float, float], dark: tuple[float, float, float]) -> Texture:
    """Return a texture with detail down to what a pixel of 0.4 mm can hold."""
    return Texture(seed=seed, light_bgr=light, dark_bgr=dark, contrast=0.8, shortest_m=0.0015, longest_m=0.025)


def _figure() -> Solid:
    """A head with a nose and an ear on a bell."""
    skin = _speckles(21, (0.42, 0.58, 0.78), (0.12, 0.22, 0.40))
    return Solid(
        (
            Body("bell", Frustum(0.038, 0.024, 0.052), (0.0, 0.0, 0.026), skin),
            Body("head", Sphere(0.029), (0.0, 0.0, 0.068), skin),
            Body("nose", Box((0.024, 0.014, 0.012)), (0.032, 0.0, 0.066), skin, rotation(_UP, 0.2)),
            Body("ear", Torus(0.013, 0.004), (-0.004, 0.031, 0.080), skin, rotation((0.0, 1.0, 0.0), math.pi / 2.0)),
        )
    )


def _wheel() -> Solid:
    """Three vanes of 3 mm and a ring of 6 mm on a shaft: what is thin is seen from both sides."""
    paint = _speckles(31, (0.66, 0.52, 0.24), (0.30, 0.20, 0.08))
    vanes = []
    for number in range(3):
        angle = 2.0 * math.pi * number / 3.0
        x, y = 0.026 * math.cos(angle), 0.026 * math.sin(angle)
        vanes.append(Body("vane", Box((0.044, 0.003, 0.052)), (x, y, 0.034), paint, rotation(_UP, angle)))
    return Solid(
        (
            Body("foot", Frustum(0.036, 0.032, 0.010), (0.0, 0.0, 0.005), paint),
            Body("shaft", Frustum(0.009, 0.008, 0.070), (0.0, 0.0, 0.040), paint),
            *vanes,
            Body("ring", Torus(0.016, 0.003), (0.0, 0.0, 0.091), paint, rotation((1.0, 0.0, 0.0), math.pi / 2.0)),
        )
    )


def _vase() -> Solid:
    """A glazed vase: the lamp is reflected in it, elsewhere for each camera."""
    glaze = Texture(
        seed=41,
        light_bgr=(0.55, 0.38, 0.22),
        dark_bgr=(0.22, 0.12, 0.06),
        contrast=0.55,
        shortest_m=0.003,
        longest_m=0.05,
        gloss=0.9,
        sharpness=50.0,
    )
    return Solid(
        (
            Body("foot", Frustum(0.030, 0.022, 0.016), (0.0, 0.0, 0.008), glaze),
            Body("belly", Sphere(0.036), (0.0, 0.0, 0.042), glaze),
            Body("neck", Frustum(0.020, 0.014, 0.034), (0.0, 0.0, 0.085), glaze),
        )
    )


def _house() -> Solid:
    """A tower house of plain plaster: nearly no texture."""
    plaster = Texture(
        seed=51,
        light_bgr=(0.60, 0.64, 0.66),
        dark_bgr=(0.50, 0.53, 0.55),
        contrast=0.10,
        shortest_m=0.002,
        longest_m=0.03,
    )
    return Solid(
        (
            Body("house", Box((0.070, 0.048, 0.046)), (0.0, 0.0, 0.023), plaster, rotation(_UP, 0.3)),
            Body("tower", Frustum(0.021, 0.021, 0.078), (0.020, 0.010, 0.039), plaster),
            Body("roof", Frustum(0.026, 0.0, 0.030), (0.020, 0.010, 0.089), plaster),
        )
    )


OBJECTS: Final[Mapping[str, Callable[[], Solid]]] = MappingProxyType(
    {"speckled": _figure, "thin": _wheel, "shiny": _vase, "plain": _house}
)
"""What can be scanned, by its name."""
