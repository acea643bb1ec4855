"""Rendered scenes with exact truth: textured planes, boxes and balls seen by two unlike cameras.

The demo, the tests and the benchmarks measure the product against them. Import from this module. Behind it,
`scene_model` defines what a scene is, `cast` casts rays, `shade` computes colour, `scene_render` makes images, `truth`
gives the exact depth and disparity, and `demo_scene` holds ready-made rigs and scenes.
"""

from phone_host.scene.cast import pixel_rays, project
from phone_host.scene.demo_scene import (
    DEMO_PERIOD_S,
    PHONE_LOOK,
    WEBCAM_LOOK,
    demo_scene,
    matched_rig,
    matched_view,
    plane_scene,
    unlike_rig,
)
from phone_host.scene.scene_model import (
    STILL,
    Body,
    Box,
    Light,
    Look,
    Path,
    Plane,
    Pose,
    RectifiedView,
    Scene,
    Shape,
    Sphere,
    Texture,
    rig_poses,
    rotation,
)
from phone_host.scene.scene_render import Renderer, render
from phone_host.scene.truth import Truth, rectified_cameras, truth

__all__ = [
    "DEMO_PERIOD_S",
    "PHONE_LOOK",
    "STILL",
    "WEBCAM_LOOK",
    "Body",
    "Box",
    "Light",
    "Look",
    "Path",
    "Plane",
    "Pose",
    "RectifiedView",
    "Renderer",
    "Scene",
    "Shape",
    "Sphere",
    "Texture",
    "Truth",
    "demo_scene",
    "matched_rig",
    "matched_view",
    "pixel_rays",
    "plane_scene",
    "project",
    "rectified_cameras",
    "render",
    "rig_poses",
    "rotation",
    "truth",
    "unlike_rig",
]
