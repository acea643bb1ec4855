"""Calibrations of other programs for tests: rigs that they can hold, files written, and what reading them must give."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.errors import DataError
from phone_host.model import CameraModel, Lens, Rig
from phone_host.output.rig_files.imported import RigKind, export_texts, import_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.rigs import points_seen_by_both, project_points, unlike_rig


def four_rig() -> Rig:
    """Two unlike cameras whose lenses all kinds can hold: k1 k2 p1 p2."""
    rig = unlike_rig()
    return replace(rig, left=_four(rig.left), right=_four(rig.right))


def _four(model: CameraModel) -> CameraModel:
    return replace(model, distortion=model.distortion[:4])


def rational_rig() -> Rig:
    """Eight coefficients on the left, five on the right."""
    rig = unlike_rig()
    distortion = np.array([0.3, 0.1, 0.001, -0.0005, 0.01, 0.5, 0.2, 0.02])
    return replace(rig, left=replace(rig.left, distortion=distortion))


def fisheye_rig() -> Rig:
    """Two fisheye lenses."""
    rig = four_rig()
    distortion = np.array([-0.02, 0.003, -0.001, 0.0005])
    left, right = (replace(model, distortion=distortion, lens=Lens.FISHEYE) for model in (rig.left, rig.right))
    return replace(rig, left=left, right=right)


def written(folder: Path, texts: dict[str, str]) -> tuple[Path, ...]:
    """Write files of these names and texts; return their paths in the same order."""
    paths = tuple(folder / name for name in texts)
    for path, text in zip(paths, texts.values(), strict=True):
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text(text)
    return paths


def exported(folder: Path, rig: Rig, kind: RigKind) -> Path:
    """Export a rig into a folder; return the folder."""
    written(folder, {each.name: each.text for each in export_texts(rig, rectify_rig(rig), kind, 64)})
    return folder


def two_texts(text: str, **of_right: str) -> dict[str, str]:
    """Both cameras' files; the right one has other numbers where the text has a name."""
    left = dict.fromkeys(of_right, "0.0")
    return {"a.yaml": text.format(**left), "b.yaml": text.format(**of_right)}


def assert_same_rig(found: Rig, rig: Rig, *, atol: float = 1e-12) -> None:
    """Check that both project the same points to the same pixels."""
    np.testing.assert_allclose(found.R_right_left, rig.R_right_left, atol=atol)
    np.testing.assert_allclose(found.t_right_left_m, rig.t_right_left_m, atol=atol)
    for a, b in ((found.left, rig.left), (found.right, rig.right)):
        assert (a.width_px, a.height_px) == (b.width_px, b.height_px)
    points = points_seen_by_both(rig, 50, seed=1).points_m
    for ours, theirs in zip(project_points(points, found), project_points(points, rig), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-8)


def assert_side_by_side(folder: Path, texts: dict[str, str]) -> None:
    """Check that the right camera stands 0.12 m right of the left one, turned by nothing."""
    rig = import_rig(written(folder, texts)).rig
    np.testing.assert_allclose(rig.t_right_left_m, [-0.12, 0, 0], atol=1e-12)
    np.testing.assert_allclose(rig.R_right_left, np.eye(3), atol=1e-12)


def assert_refused(folder: Path, texts: dict[str, str], said: str, remedy: str) -> None:
    """Check that these files are refused in these words, after the folder's name, with a remedy that holds these."""
    with pytest.raises(DataError) as caught:
        import_rig(written(folder, texts))
    assert caught.value.problem.removeprefix(f"{folder}/") == said
    assert remedy in caught.value.remedy
