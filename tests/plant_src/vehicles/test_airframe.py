"""Airframes: physically impossible data are refused, all problems together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cosim.core.errors import InputError
from plant_src.catalogue import MODELS
from plant_src.vehicles.common.shapes import principal_axes
from plant_src.vehicles.multirotor.airframe import Airframe, Rotor, RotorEffects

assert MODELS["crazyflie"].airframe is not None
AIRFRAME = MODELS["crazyflie"].airframe
NOSE = Rotor("nose", (0.1, 0.0, 0.0), 1.0, 1e-5, 1e-7)

FAULTS = [
    ({"mass": -1.0}, "mass: found -1.0, expected a finite number greater than 0"),
    ({"rotor_radius": float("nan")}, "rotor_radius: found nan"),
    (
        {"inertia": np.diag([1.0, 1.0, 3.0])},
        (
            r"inertia: found the principal moments 1 about x, 1 about y, 3 about z, expected none "
            r"greater than the sum"
        ),
    ),
    ({"inertia": np.diag([1.0, -1.0, 1.0])}, "expected all greater than 0"),
    ({"inertia": np.array([[1, 0.5, 0], [0, 1, 0], [0, 0, 1]])}, "expected a symmetric tensor"),
    ({"inertia": np.eye(2)}, "expected 3 rows of 3 finite numbers"),
    ({"rotors": ()}, "rotors: found none"),
    (
        {"rotors": (replace(NOSE, torque_sign=0.5),)},
        r"rotors\[1\].torque_sign: found 0.5, expected 1 or -1",
    ),
    (
        {"rotors": (Rotor("nose", (0.1, 0.0, 0.0), 1.0, 1e-5, 1e-7, (0.0, 0.0, 2.0)),)},
        r"rotors\[1\].axis: .* expected a unit vector",
    ),
    (
        {"effects": RotorEffects(body_drag=(0.0, -0.1, 0.0))},
        "effects.body_drag: found .* expected finite numbers of at least 0",
    ),
]


@pytest.mark.parametrize(("change", "text"), FAULTS)
def test_impossible_data_are_refused(change: dict, text: str) -> None:
    with pytest.raises(InputError, match=f"airframe crazyflie: .*{text}"):
        replace(AIRFRAME, **change)


def test_all_faults_are_reported_together() -> None:
    with pytest.raises(InputError) as caught:
        replace(
            AIRFRAME,
            mass=0.0,
            inertia=np.diag([1.0, 1.0, 3.0]),
            effects=RotorEffects(ground_effect=-1.0),
        )
    assert len(caught.value.problems) == 3


def with_inertia(tensor: np.ndarray) -> Airframe:
    return replace(AIRFRAME, inertia=(tensor + tensor.T) / 2)


@pytest.mark.parametrize("seed", range(20))
def test_principal_axes_make_the_inertia_diagonal(seed: int) -> None:
    turn = Rotation.random(random_state=seed).as_matrix()
    tensor = turn @ np.diag([1.0, 1.5, 2.0]) @ turn.T
    moments, axes = principal_axes(tensor)
    assert axes @ np.diag(moments) @ axes.T == pytest.approx(tensor, abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert (
        np.trace(axes) > 0
    )  # angle less than 120 degrees, as `shapes.quaternion_from_matrix` requires


@pytest.mark.parametrize("name", ["ar_drone", "crazyflie", "survey_hexacopter"])
def test_a_standing_vehicle_has_its_rotors_above_its_feet(name: str) -> None:
    model = MODELS[name]
    (box,) = model.body.boxes
    assert model.rotor_disc is not None
    assert box.corners()[:, 2].min() < 0 < model.rotor_disc[0][2]
    assert np.ptp(box.corners()[:, :2], axis=0).min() < 1.0
