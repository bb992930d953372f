"""Mass and inertia of a rigid body: checks, parameters and principal axes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import permutations, product

import numpy as np

from cosim.core.component import Variable

from .interface import scalar_variable
from .shapes import Body, Shape, quaternion_from_matrix

#: function from the rotation matrix (3, 3) principal axes to body frame to the collision shape in
#: principal axes
Boxes = Callable[[np.ndarray], tuple[Shape, ...]]

#: relative rounding error of the elements of a matrix
_TOLERANCE = 1e-9

#: parameter -> row and column in the symmetric inertia tensor
INERTIA_INDICES = {
    "inertia.xx": (0, 0),
    "inertia.yy": (1, 1),
    "inertia.zz": (2, 2),
    "inertia.xy": (0, 1),
    "inertia.xz": (0, 2),
    "inertia.yz": (1, 2),
}


def inertia_variables(mass: float, inertia: np.ndarray, mass_text: str) -> tuple[Variable, ...]:
    """Return the parameters `mass` (kg) and `inertia.*` (kg m2, centre of mass, body frame)."""
    text = "inertia tensor about the centre of mass, body frame, rotors locked"
    tensor = (
        scalar_variable(name, "kg.m2", f"{text}: {name[-2:]}", "parameter", float(inertia[place]))
        for name, place in INERTIA_INDICES.items()
    )
    return (scalar_variable("mass", "kg", mass_text, "parameter", mass), *tensor)


def inertia_of(parameters: Mapping[str, float]) -> np.ndarray:
    """Return the inertia tensor (kg m2) of the parameters `inertia.*`, shape (3, 3)."""
    inertia = np.zeros((3, 3))
    for name, (i, j) in INERTIA_INDICES.items():
        inertia[i, j] = inertia[j, i] = parameters[name]
    return inertia


def inertia_problems(inertia: np.ndarray) -> Iterator[str]:
    """Yield a message if no rigid body has this inertia tensor (kg m2)."""
    tensor = np.asarray(inertia, float)
    if tensor.shape != (3, 3) or not np.isfinite(tensor).all():
        yield f"found {tensor.tolist()}, expected 3 rows of 3 finite numbers"
    elif not np.allclose(tensor, tensor.T, rtol=1e-12, atol=0):
        yield f"found {tensor.tolist()}, expected a symmetric tensor"
    else:
        moments, axes = np.linalg.eigh(tensor)  # in ascending order
        small, middle, large = moments.tolist()
        if small <= 0:
            yield (
                f"found the principal moments {_moments_text(moments, axes)}, expected all greater "
                "than 0"
            )
        elif large > (small + middle) * (1 + 1e-9):
            text = _moments_text(moments, axes)
            yield (
                f"found the principal moments {text}, expected none greater than the sum of the "
                "other two"
            )


def symmetry_problems(matrix: np.ndarray) -> Iterator[str]:
    """Yield a message if a matrix is not symmetric."""
    if not np.allclose(matrix, matrix.T, rtol=_TOLERANCE, atol=0):
        yield "expected a symmetric matrix"


def eigenvalue_problems(matrix: np.ndarray) -> Iterator[str]:
    """Yield a message if the symmetric part of a matrix is not positive semi-definite.

    The kinetic energy of added mass and the power that damping takes away would be negative for
    some motion.
    """
    lowest = float(np.linalg.eigvalsh((matrix + matrix.T) / 2)[0])
    if lowest < -_TOLERANCE * np.abs(matrix).max():
        yield f"found the eigenvalue {lowest:g}, expected none below 0"


def _moments_text(moments: np.ndarray, axes: np.ndarray) -> str:
    """Return principal moments with their axes in words, in the order of the nearest body axes."""
    nearest = np.argmax(np.abs(axes), axis=0)
    texts = []
    for k in np.argsort(nearest, kind="stable"):
        axis, largest = axes[:, k], axes[nearest[k], k]
        components = ", ".join(f"{round(x / np.sign(largest), 2) + 0.0:g}" for x in axis)
        name = "xyz"[nearest[k]] if abs(largest) > 1 - 1e-9 else f"[{components}]"
        texts.append(f"{moments[k]:.4g} about {name}")
    return ", ".join(texts)


def principal_axes(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the principal moments of inertia and their axes.

    Args:
        inertia: Inertia tensor (kg m2, body frame), shape (3, 3).

    Returns:
        Moments of inertia (kg m2), shape (3,), and the rotation matrix from the principal axes to
        the body frame, shape (3, 3). Its angle is less than 120 degrees; subject to that, the
        moments ascend.
    """
    moments, axes = np.linalg.eigh(inertia)
    for order in permutations(range(3)):
        ordered = axes[:, order] * np.where(np.diag(axes[:, order]) < 0, -1.0, 1.0)
        for signs in product((1.0, -1.0), repeat=3):
            to_body = ordered * signs[::-1]
            if np.linalg.det(to_body) > 0 and np.trace(to_body) > 0:
                return moments[list(order)], to_body
    raise AssertionError(
        "one of the 24 frames of the principal axes is rotated by less than 63 degrees"
    )


def principal_body(mass: float, inertia: np.ndarray, boxes: Boxes) -> Body:
    """Return a rigid body for Bullet, in its principal axes.

    Args:
        mass: Mass (kg).
        inertia: Inertia tensor about the centre of mass (kg m2, body frame), shape (3, 3).
        boxes: Collision shape.
    """
    moments, to_body = principal_axes(inertia)
    x, y, z = moments.tolist()
    return Body(mass, (x, y, z), boxes(to_body), axes=quaternion_from_matrix(to_body))
