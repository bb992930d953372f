"""Rotations in plain floats against SciPy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plant_src.sensors import rotations

RANDOM = np.random.default_rng(5)
QUATERNIONS = [q / np.linalg.norm(q) for q in RANDOM.normal(size=(20, 4))]


def scipys(q):
    return Rotation.from_quat([*q[1:], q[0]])


@pytest.mark.parametrize("q", QUATERNIONS)
def test_vector_rotations_equal_scipy_and_are_inverse(q):
    v = RANDOM.normal(size=3)
    assert np.allclose(rotations.to_world(q, v), scipys(q).apply(v), atol=1e-14)
    assert np.allclose(rotations.to_body(q, rotations.to_world(q, v)), v, atol=1e-14)


@pytest.mark.parametrize("q", QUATERNIONS)
def test_euler_angles_equal_scipy(q):
    roll, pitch, yaw = rotations.euler_angles(q)
    assert np.allclose((yaw, pitch, roll), scipys(q).as_euler("ZYX"), atol=1e-12)


def test_products_and_rotation_vectors_equal_scipy():
    for a, b in zip(QUATERNIONS[::2], QUATERNIONS[1::2], strict=True):
        assert np.allclose(
            scipys(rotations.quaternion_product(a, b)).as_matrix(),
            (scipys(a) * scipys(b)).as_matrix(),
            atol=1e-14,
        )
        v = RANDOM.normal(size=3)
        assert np.allclose(
            scipys(rotations.quaternion_from_rotation_vector(v)).as_matrix(),
            Rotation.from_rotvec(v).as_matrix(),
            atol=1e-14,
        )


def test_midpoint_is_half_of_the_shorter_rotation():
    a = rotations.quaternion_from_rotation_vector((0.0, 0.0, 0.2))
    b = rotations.quaternion_from_rotation_vector((0.0, 0.0, 0.8))
    for other in (b, [-x for x in b]):
        assert np.allclose(
            rotations.midpoint_attitude(a, other),
            rotations.quaternion_from_rotation_vector((0.0, 0.0, 0.5)),
            atol=1e-15,
        )
