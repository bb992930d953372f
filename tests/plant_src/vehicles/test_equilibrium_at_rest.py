"""A floating vessel whose centre of mass is not above the centre of its waterplane."""

from __future__ import annotations

import copy
import json
from typing import Any

import pytest
from world_harness import WorldHarness

from cosim.core import resources
from cosim.core.errors import InputError
from plant_src.catalogue import model_from_data
from plant_src.vehicles.surface_vessel.surface_vessel import SurfaceVessel, rest

BOAT = json.loads((resources.root() / "plant_src/vehicles/data/blueboat.json").read_text())


def boat(ahead: float, port: float) -> dict[str, Any]:
    """Data of the BlueBoat with a shifted centre of mass (m)."""
    x, y, z = BOAT["centre_of_mass"]["value"]
    return {**copy.deepcopy(BOAT), "centre_of_mass": [x + ahead, y + port, z]}


def test_small_shifts_give_the_angles_of_the_metacentric_heights() -> None:
    vessel = model_from_data(boat(0.005, 0.01)).boat
    assert isinstance(vessel, SurfaceVessel)
    transverse, longitudinal = vessel.metacentric_heights
    attitude = rest(vessel)
    assert attitude is not None
    assert attitude.trim == pytest.approx(0.005 / longitudinal, rel=0.02)
    assert attitude.heel == pytest.approx(-0.01 / transverse, rel=0.02)


def test_a_boat_comes_to_rest_as_predicted() -> None:
    data = boat(0.0, 0.06)
    trial = WorldHarness({"usv": {"model": data, "position": [0, 0]}})
    trial.step(3000)
    vessel = model_from_data(data).boat
    assert isinstance(vessel, SurfaceVessel)
    attitude = rest(vessel)
    assert attitude is not None
    assert trial.vector("usv.attitude", ("roll", "pitch")) == pytest.approx(
        [attitude.heel, attitude.trim], abs=2e-3
    )


@pytest.mark.parametrize(("ahead", "port"), [(-0.4, 0.0), (0.4, 0.0), (0.0, 0.5)])
def test_a_boat_that_capsizes_or_wets_its_deck_is_refused(ahead: float, port: float) -> None:
    with pytest.raises(
        InputError, match=r"centre_of_mass: found .* (capsizes|a deck edge is under water)"
    ):
        model_from_data(boat(ahead, port))
