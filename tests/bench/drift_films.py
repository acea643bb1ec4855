"""Rendered films for bench_drift: a room before two webcams of which the right one turns, zooms, lags, or sees somebody walk by."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Final

import cv2
import numpy as np

from phone_host.model import CameraModel, Departure, Rig
from phone_host.scene.scene_model import Body, Box, Look, Path, Plane, Scene, Sphere, Texture, rig_poses, rotation
from phone_host.scene.scene_render import Renderer
from phone_host.stereo.rectifier import corrected_rig
from tests.bench.depth_scenes import Image

JPEG_QUALITY: Final = 90

_SWING_S: Final = 7.0
"""An automatic exposure that hunts takes some seconds to and fro."""


@dataclass(frozen=True, slots=True)
class Act:
    """How the rig stands from a moment on.

    Attributes:
        from_s: that moment, s.
        departure: of the right camera.
    """

    from_s: float
    departure: Departure


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Play:
    """A film.

    Attributes:
        name: for the table.
        scene: what is seen.
        acts: how the rig stands, in order; before the first as it was calibrated.
        seconds: length.
        fps: pairs per second.
        late_s: by how much later than stated the left image is exposed.
        looks: the two sensors.
        jpeg: quality of both cameras' images.
        swing: by this share the right camera's automatic exposure swings about its mean.
        shake_deg: the right camera trembles against the left one by this, standard deviation about each axis.
    """

    name: str
    scene: Scene
    acts: tuple[Act, ...] = ()
    seconds: float = 8.0
    fps: int = 15
    late_s: float = 0.0
    looks: tuple[Look, Look] = field(
        default=(
            Look(gain_bgr=(0.95, 0.97, 1.02), offset=4.0, vignetting=0.2, noise_sigma=2.0, seed=1),
            Look(gain_bgr=(1.05, 1.0, 0.97), vignetting=0.1, noise_sigma=2.0, seed=2),
        )
    )

    jpeg: int = JPEG_QUALITY
    swing: float = 0.0
    shake_deg: float = 0.0

    def departure_at(self, t_s: float) -> Departure:
        """Return how the right camera departs at a moment."""
        begun = [act.departure for act in self.acts if act.from_s <= t_s + 1e-9]
        return begun[-1] if begun else Departure()


def play_rig() -> Rig:
    """Two webcams of 640x480 with some distortion, 80 mm apart, the right one turned by a degree."""
    matrix = np.array([[540.0, 0, 317.0], [0, 541.0, 243.0], [0, 0, 1]])
    left = CameraModel(
        width_px=640, height_px=480, matrix=matrix, distortion=np.array([-0.12, 0.04, 0.0004, -0.0003, 0.0])
    )
    right = replace(left, matrix=np.array([[552.0, 0, 324.0], [0, 551.0, 236.0], [0, 0, 1]]))
    turn = rotation((0.3, 1.0, 0.2), math.radians(1.0))
    return Rig(left=left, right=right, R_right_left=turn, t_right_left_m=-turn @ np.array([0.08, 0.0006, -0.0008]))


def furnished_room(seed: int = 0, *, contrast: float = 0.5) -> Scene:
    """A room with shelves of things at 0.9 to 3 m."""
    random = np.random.default_rng([seed, 51])

    def texture(number: int) -> Texture:
        return Texture(seed=1000 * seed + number, contrast=contrast, shortest_m=0.006, longest_m=0.2)

    flat, aside = rotation((1.0, 0.0, 0.0), -math.pi / 2), rotation((0.0, 1.0, 0.0), math.pi / 2)
    bodies = [
        Body("wall", Plane(), (0.0, 0.0, 3.0), texture(1), rotation((0, 1, 0), 0.2)),
        Body("floor", Plane(), (0.0, 0.8, 1.5), texture(2), flat),
        Body("side", Plane(), (-1.4, 0.0, 3.0), texture(3), aside),
    ]
    for number in range(8):
        z = float(random.uniform(0.9, 2.6))
        x, y, size = (float(random.uniform(-0.45, 0.45)) * z, float(random.uniform(-0.3, 0.25)) * z, 0.1 * z)
        turn = rotation((float(random.normal()), 1.0, 0.2), float(random.uniform(0, 3)))
        shape = Sphere(size) if number % 3 == 0 else Box((size * 1.6, size, size))
        bodies.append(Body(f"thing {number}", shape, (x, y, z), texture(10 + number), turn))
    return Scene(tuple(bodies))


def with_walker(scene: Scene) -> Scene:
    """Add somebody who fills half of the image and moves to and fro, up and down."""
    clothes = Texture(seed=77, contrast=0.5, shortest_m=0.008, longest_m=0.12)
    walk = Path(amplitude_m=(0.12, 0.05, 0.0), phase_rad=(0.0, 0.7, 0.0), period_s=1.7)
    return replace(
        scene, bodies=(*scene.bodies, Body("walker", Box((0.55, 1.4, 0.2)), (0.3, 0.1, 0.9), clothes, path=walk))
    )


def bare_room() -> Scene:
    """Plain walls."""
    plain = Texture(
        seed=5, contrast=0.0, light_bgr=(0.7, 0.7, 0.7), dark_bgr=(0.69, 0.69, 0.69), shortest_m=0.2, longest_m=1.6
    )
    return Scene(
        (Body("wall", Plane(), (0.0, 0.0, 2.0), plain), Body("thing", Sphere(0.06), (0.1, 0.1, 1.2), Texture(seed=9)))
    )


def checked_wall() -> Scene:
    """A wall that repeats in both directions: planks with a regular grain, as many boxes as fit."""
    light = Texture(seed=5, contrast=0.0, light_bgr=(0.8, 0.8, 0.8), dark_bgr=(0.8, 0.8, 0.8))
    tile = Texture(seed=6, contrast=0.0, light_bgr=(0.2, 0.2, 0.2), dark_bgr=(0.2, 0.2, 0.2))
    bodies = [Body("wall", Plane(), (0.0, 0.0, 2.0), light)]
    for row in range(-8, 9):
        for column in range(-11, 12):
            if (row + column) % 2 == 0:
                at = (0.11 * column, 0.11 * row, 1.995)
                bodies.append(Body(f"tile {row} {column}", Plane(0.11, 0.11), at, tile))
    return Scene(tuple(bodies))


def dark(play: Play) -> Play:
    """The same film with the light out: 2 % of it, and the sensors' noise."""
    looks = tuple(replace(look, gain_bgr=(0.02, 0.02, 0.02)) for look in play.looks)
    return replace(play, looks=(looks[0], looks[1]))


def vibrating(scene: Scene) -> Scene:
    """The whole scene trembles before the rig, some pixels ten times a second: a bar on a machine."""
    tremble = Path(amplitude_m=(0.004, 0.004, 0.0), phase_rad=(0.0, 1.1, 0.0), period_s=0.093)
    return replace(scene, bodies=tuple(replace(body, path=tremble) for body in scene.bodies))


def steady_minutes(seed: int) -> list[Play]:
    """Ten minutes of rigs that stand as they were calibrated, each with another nuisance and a room of its own.

    Args:
        seed: of the rooms.
    """

    def play(
        number: int, name: str, *, contrast: float = 0.5, walker: bool = False, gain: float = 1.0, noise: float = 2.0
    ) -> Play:
        room = furnished_room(10 * seed + number, contrast=contrast)
        scene = with_walker(room) if walker else room
        looks = (
            Look(gain_bgr=(gain,) * 3, offset=4.0, noise_sigma=noise, seed=1),
            Look(gain_bgr=(gain,) * 3, noise_sigma=noise, seed=2),
        )
        return Play(name=f"{name}, room {10 * seed + number}", scene=scene, seconds=60, looks=looks)

    trembles = play(7, "vibration")
    return [
        play(0, "quiet"),
        play(1, "pale", contrast=0.25),
        play(2, "walker", walker=True),
        replace(play(3, "walker, 5 ms late", walker=True), late_s=0.005),
        play(4, "dim", gain=0.1),
        play(5, "noise", noise=12.0),
        replace(play(6, "JPEG 50, exposure hunts"), jpeg=50, swing=0.4),
        replace(trembles, scene=vibrating(trembles.scene), late_s=0.002),
        replace(play(8, "trembling by 0.01 degrees"), shake_deg=0.01),
        replace(
            play(9, "repeats"),
            scene=replace(checked_wall(), bodies=(*checked_wall().bodies, *furnished_room(10 * seed + 9).bodies[3:])),
        ),
    ]


def turned(from_s: float, axis: int, degrees: float) -> Act:
    """The right camera turns at once.

    Args:
        from_s: when, s.
        axis: 0 pitch, 1 yaw, 2 roll.
        degrees: by how much.
    """
    turn = [0.0, 0.0, 0.0]
    turn[axis] = math.radians(degrees)
    return Act(from_s, Departure(turn_rad=(turn[0], turn[1], turn[2])))


def in_steps(from_s: float, axis: int, degrees: float, *, count: int, seconds: float) -> tuple[Act, ...]:
    """The right camera turns little by little; see `turned`.

    Args:
        from_s: the first step, s.
        axis: see `turned`.
        degrees: in all.
        count: of steps.
        seconds: from the first to the last step, s.
    """
    times = np.linspace(from_s, from_s + seconds, count).tolist()
    return tuple(turned(at_s, axis, degrees * (number + 1) / count) for number, at_s in enumerate(times))


def judged_pairs(play: Play, rig: Rig, period_s: float) -> Iterator[tuple[float, Image, Image, Image]]:
    """Render the pairs of a film that a run would judge: moment, left and right image, and the left one of the pair before.

    Args:
        play: the film.
        rig: as it was calibrated.
        period_s: time between two judged pairs, s.
    """
    left = Renderer(play.scene, rig.left, rig_poses(rig)[0], play.looks[0])
    rights: dict[Departure, Renderer] = {}
    random, due_s = np.random.default_rng(51), 0.0
    for number in range(1, round(play.seconds * play.fps)):
        t_s = number / play.fps
        if t_s < due_s - 1e-9:
            continue
        due_s = t_s + period_s
        departure = _trembling(play.departure_at(t_s), play.shake_deg, random)
        if departure not in rights:
            stands = corrected_rig(rig, departure)
            rights = {departure: Renderer(play.scene, stands.right, rig_poses(stands)[1], play.looks[1])}
        seen = [_sent(left.frame(at_s + play.late_s), play.jpeg) for at_s in (t_s, t_s - 1 / play.fps)]
        gain = 1 + play.swing * math.sin(math.tau * t_s / _SWING_S)
        yield t_s, seen[0], _sent(cv2.convertScaleAbs(rights[departure].frame(t_s), alpha=gain), play.jpeg), seen[1]


def _trembling(departure: Departure, shake_deg: float, random: np.random.Generator) -> Departure:
    if not shake_deg:
        return departure
    x, y, z = (np.array(departure.turn_rad) + np.radians(random.normal(0, shake_deg, 3))).tolist()
    return replace(departure, turn_rad=(x, y, z))


def _sent(image: "cv2.typing.MatLike", jpeg: int) -> Image:
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, jpeg])
    assert done
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)
