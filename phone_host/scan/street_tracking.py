"""How a camera is tracked in a street, and how elsewhere. Pure."""

from typing import Final

from phone_host.scan.odometry import OdometrySettings
from phone_host.scan.piece import PoseGate
from phone_host.scan.volume_settings import VolumeSettings

_ODOMETRY: Final = OdometrySettings(corners=400, apart_px=8, keyframe_share=0.6, keyframe_after=5)
"""The model carries the accuracy; odometry, on half the image, only has to start near it. At VGA that saves 20 of 30 ms of processor time."""

_STREET_ODOMETRY: Final = OdometrySettings(corners=400, apart_px=8, keyframe_share=0.7, keyframe_after=1)
"""In a street odometry carries the accuracy, on the whole image: a depth at 15 m has 0.3 m of noise, and what was fused soon leaves the picture. On 24 pairs
of KITTI the trajectory is 22 mm off, where half the image gives 131 mm; 1000 corners give 32 mm and take twice the time."""

_POOR_NOISE_PER_M: Final = 0.006
"""Noise of a depth 1 m away, m, from which a keyframe's new points are so far off that each view as a keyframe harms: with 0.010 (f = 400 px, b = 0.12 m) a
rendered street's trajectory is 106 mm off, with every fifth view as a keyframe 29 mm; with 0.004 (b = 0.3 m) 17 and 22 mm."""

_STREET_GATE: Final = PoseGate(most_shift_m=0.25, least_overlap=0.2)
"""In a street a place tells the pose to some decimetres, and of what a car sees a fifth to a third lies on the model 1.2 m farther on; near 1.00 of it fits."""


def odometry_for(settings: VolumeSettings) -> OdometrySettings:
    """Choose how odometry follows the corners.

    Args:
        settings: of the model.
    """
    is_exact = settings.noise_per_m < _POOR_NOISE_PER_M
    return _STREET_ODOMETRY if settings.is_of_street and is_exact else _ODOMETRY


def pose_gate_for(settings: VolumeSettings) -> PoseGate:
    """Choose what a pose must fulfil to be believed.

    Args:
        settings: of the model.
    """
    return _STREET_GATE if settings.is_of_street else PoseGate()
