"""Sightings of random points by a rig whose right camera departs from its calibration: exact projections, and noise."""

from dataclasses import dataclass, replace

import numpy as np

from phone_host.calibration.drift.fit import RowModel, Sighting
from phone_host.geometry.lens import project
from phone_host.model import AS_CALIBRATED, CameraModel, Departure, Rig, Side
from phone_host.scene.scene_model import rotation
from phone_host.stereo.evidence_points import ThroughRig
from phone_host.stereo.evidence_track import Followed
from phone_host.stereo.rectifier import corrected_rectification, corrected_rig
from phone_host.stereo.rectify import rectify_rig


def two_webcams(*, is_stacked: bool = False) -> Rig:
    """Two webcams of 640x480 with some distortion, the right one turned by a degree; 80 mm to the right, or above."""
    matrix = np.array([[540.0, 0, 317.0], [0, 541.0, 243.0], [0, 0, 1]])
    left = CameraModel(
        width_px=640, height_px=480, matrix=matrix, distortion=np.array([-0.1, 0.03, 0.0004, -0.0003, 0])
    )
    right = replace(left, matrix=np.array([[552.0, 0, 324.0], [0, 551.0, 236.0], [0, 0, 1]]))
    turn = rotation((0.3, 1.0, 0.2), 0.017)
    centre_m = np.array([0.001, -0.08, 0.001] if is_stacked else [0.08, 0.001, -0.001])
    return Rig(left=left, right=right, R_right_left=turn, t_right_left_m=-turn @ centre_m)


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Makes sightings of one rig.

    Attributes:
        rig: as it was calibrated.
        model: of its rows.
        calibrated: how it rectifies points.
    """

    rig: Rig
    model: RowModel
    calibrated: ThroughRig

    def features(
        self,
        seed: int,
        departure: Departure,
        corrected: Departure = AS_CALIBRATED,
        *,
        count: int = 120,
    ) -> Followed:
        """Features of still points at 0.6 to 4 m, as images rectified with `corrected` show them."""
        random = np.random.default_rng(seed)
        own = random.uniform((5, 5), (635, 475), (count, 2))
        rays = np.column_stack([(own - self.rig.left.matrix[:2, 2]) / 540.0, np.ones(count)])
        points = rays / np.linalg.norm(rays, axis=1, keepdims=True) * random.uniform(0.6, 4.0, (count, 1))
        stands = corrected_rig(self.rig, departure)
        right = project(points @ stands.R_right_left.T + stands.t_right_left_m, stands.right)
        now = self.through(corrected)
        left_px = now.rectified(project(points, self.rig.left), Side.LEFT)
        right_px = now.rectified(right, Side.RIGHT)
        return Followed(left_px, right_px, np.zeros((count, 2)))

    def through(self, corrected: Departure) -> ThroughRig:
        """Return how points go through the rectification with a correction."""
        made = self.calibrated.rectification
        return ThroughRig(corrected_rig(self.rig, corrected), corrected_rectification(made, corrected))

    def sighting(
        self,
        seed: int,
        departure: Departure,
        *,
        count: int = 120,
        noise_px: float = 0.1,
        speed_px_s: float = 0.0,
        late_s: float = 0.0,
        stated_s: float = 0.0,
    ) -> Sighting:
        """A sighting with noise, some wrong matches, and a moving half.

        Args:
            seed: chooses points and noise.
            departure: of the right camera.
            count: of features.
            noise_px: standard deviation of the rows.
            speed_px_s: of the points in the left half, across the lines; they change direction with the seed.
            late_s: by how much later the left image is exposed.
            stated_s: what the stamps say of that.
        """
        seen = self.model.sighting(
            self.features(seed, departure, count=count), self.calibrated, self.calibrated, stated_s
        )
        random = np.random.default_rng([seed, 1])
        speed = np.where(seen.slopes[:, 0] < 0, speed_px_s * (1 if seed % 2 else -1), 0.0)
        off_px = seen.off_px + random.normal(0, noise_px, len(seen.off_px)) - speed * late_s
        off_px[::12] += random.uniform(-4, 4, len(off_px[::12]))
        return replace(seen, off_px=off_px, speed_px_s=speed)


def sight(*, is_stacked: bool = False) -> Sight:
    """Return a maker of sightings for `two_webcams`."""
    rig = two_webcams(is_stacked=is_stacked)
    made = rectify_rig(rig)
    return Sight(rig, RowModel(rig, made), ThroughRig(rig, made))
