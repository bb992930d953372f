"""Descriptions of arrays whose elements are rotors, thrusters, propellers or rudders."""

import pytest

from cosim.components.fmi import FmuFile
from cosim.core import resources


@pytest.mark.parametrize(
    ("model", "count", "inputs"),
    [
        ("surface_vessel", "propeller_count", ("propeller_speed", "azimuth")),
        ("planar_vessel", "rudder_count", ("rudder_angle",)),
        ("multirotor", "rotor_count", ("rotor_speed",)),
        ("submerged", "16", ("thruster_speed",)),
    ],
)
def test_arrays_with_unused_elements_name_the_number_in_use(
    model: str, count: str, inputs: tuple[str, ...]
) -> None:
    variables = {
        each.name: each
        for each in FmuFile(resources.root() / f"fmus/{model}.fmu").description.variables
    }
    assert count in variables or count == "16"
    for name in inputs:
        assert f"(1 to {count})" in variables[f"{name}[16]"].description


def test_a_vehicle_names_the_places_of_all_elements() -> None:
    variables = {
        each.name: each
        for each in FmuFile(resources.root() / "fmus/wamv16.fmu").description.variables
    }
    assert variables["azimuth[2]"].description.startswith(
        "azimuth angles (port, starboard), without lag; positive: "
    )
