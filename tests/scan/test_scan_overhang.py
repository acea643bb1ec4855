"""An object that hangs over the mat: the ink below the overhang is not taken for its surface."""

import numpy as np
import pytest

from common import now
from phone_host.scan.mat import USUAL_MAT, parse_mat
from phone_host.scan.mesh import Mesh
from phone_host.scan.scan import scan_for
from phone_host.scan.scan_model import ScanModel, specks
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scene.object_scene import ObjectScene, Setting, Size, mat_body, object_rig
from phone_host.scene.scene_model import Body, Frustum, Texture
from phone_host.scene.solid import Solid
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier

OFF_M = 0.002
"""Nearly three times what 95 % of the points of this object are off."""


def grey(seed: int) -> Texture:
    """A grey surface with little texture, twice as bright as ink or brighter."""
    return Texture(
        seed=seed, light_bgr=(0.3,) * 3, dark_bgr=(0.2,) * 3, contrast=0.15, shortest_m=0.0015, longest_m=0.025
    )


def mushroom() -> Solid:
    """A cap that hangs 9 mm above the mat, 28 mm beyond its stem."""
    return Solid(
        (
            Body("stem", Frustum(0.018, 0.018, 0.02), (0.0, 0.0, 0.01), grey(21)),
            Body("cap", Frustum(0.046, 0.030, 0.04), (0.0, 0.0, 0.029), grey(22)),
        )
    )


@pytest.fixture(scope="module")
def model() -> ScanModel:
    """The mushroom from four sides next to each other, 30 degrees apart."""
    scene = ObjectScene(mushroom(), object_rig(Size.VGA), Setting(views=12), mat_body())
    core = StereoCore(
        MatchSettings(matcher=MatcherName.TANDEM, disparities=512),
        Rectifier(scene.rig),
        wanted=DepthWanted(search_from_m=0.28),
    )
    scan = scan_for(ScanWanted(mat=parse_mat(USUAL_MAT)))
    for number in range(4):
        view = scene.view(number)
        scan.take(str(number), float(number), core.compute(view.left, view.right, now.monotonic_ns))
    assert scan.fused == 4
    return scan.model()


def test_ink_below_an_overhang_counts_as_unseen(model: ScanModel) -> None:
    """Of what is called seen, nothing lies 2 mm off the object; without the check 102 points did, up to 8 mm, as dark as the mat's ink."""
    off_m = np.abs(mushroom().signed_distance(model.mesh.points_m.astype(np.float64)))
    assert model.seen.sum() > 5000
    assert (model.seen & (off_m > OFF_M)).sum() == 0
    assert np.isnan(model.noise_m[~model.seen]).all()


def test_the_fill_is_as_grey_as_the_object(model: ScanModel) -> None:
    """Neither pink nor ink bleeds into the surface that nobody saw: its mean is that of the seen surface within 20 of 255, and its darkest points are no ink."""
    filled, seen = (model.mesh.colours[flags].astype(float) for flags in (~model.seen, model.seen))
    assert np.abs(filled.mean(axis=0) - seen.mean(axis=0)).max() < 20
    assert np.percentile(filled.mean(axis=1), 1) > 50


def test_specks_of_measured_surface_are_no_surface() -> None:
    """A triangle alone beside a strip of a thousand is a speck; the strip is none, and without any triangle nothing is."""
    strip = np.column_stack([np.arange(1000), np.arange(1000) + 1, np.arange(1000) + 2])
    triangles = np.concatenate([strip, [[1002, 1003, 1004]]]).astype(np.int32)
    mesh = Mesh(np.zeros((1005, 3), np.float32), np.zeros((1005, 3), np.uint8), triangles)
    found = specks(mesh, np.ones(1005, np.bool_))
    assert found.nonzero()[0].tolist() == [1002, 1003, 1004]
    assert not specks(mesh, np.zeros(1005, np.bool_)).any()
