"""Rotations and rigid motions: against OpenCV's Rodrigues, and the laws of the group."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from phone_host.geometry.se3 import SE3, cross_matrices, rotations_of, vectors_of

vectors = arrays(np.float64, 3, elements=st.floats(-1.7, 1.7))
motions = arrays(np.float64, 6, elements=st.floats(-1.5, 1.5))


@given(vectors)
def test_rotations_are_opencvs(vector: np.ndarray) -> None:
    """Both ways, for single vectors and for stacks of them."""
    rotation = rotations_of(vector)
    np.testing.assert_allclose(rotation, cv2.Rodrigues(vector)[0], atol=1e-12)
    np.testing.assert_allclose(vectors_of(rotation), vector, atol=1e-7)
    np.testing.assert_allclose(vectors_of(np.stack([rotation, np.eye(3)])), [vector, np.zeros(3)], atol=1e-7)


@pytest.mark.parametrize("axis", [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.6, -0.64, 0.48]])
@pytest.mark.parametrize("angle", [np.pi, np.pi - 1e-3, np.pi - 1e-7, 1e-9])
def test_half_turns_and_tiny_turns_have_vectors(axis: list[float], angle: float) -> None:
    """Where sines vanish the rotation still comes back; half a turn about an axis is one about its opposite, too."""
    rotation = np.asarray(cv2.Rodrigues(np.array(axis) * angle)[0], np.float64)
    np.testing.assert_allclose(rotations_of(vectors_of(rotation)), rotation, atol=1e-9)
    stack = np.stack([rotation, np.eye(3)])
    np.testing.assert_allclose(rotations_of(vectors_of(stack)), stack, atol=1e-9)


@given(motions, motions, vectors)
def test_motions_are_a_group(one: np.ndarray, other: np.ndarray, point: np.ndarray) -> None:
    """Composition applies the second motion first; the inverse leads back; pose and of undo each other."""
    first, second = SE3.of(one), SE3.of(other)
    np.testing.assert_allclose((first @ second).apply(point), first.apply(second.apply(point)), atol=1e-12)
    np.testing.assert_allclose(first.inverse().apply(first.apply(point)), point, atol=1e-12)
    np.testing.assert_allclose(SE3.of(first.pose()).t_m, first.t_m, atol=1e-12)


def test_cross_matrices_multiply_like_cross_products() -> None:
    """For stacks of vectors."""
    random = np.random.default_rng(0)
    a, b = random.normal(size=(2, 5, 3))
    np.testing.assert_allclose(np.einsum("nij,nj->ni", cross_matrices(a), b), np.cross(a, b))
