"""Invalid connections: units, types and prefixes."""

import pytest
from systems import connection

import cosim
from cosim.core import resources


def test_units_of_different_quantities_are_refused(folder):
    fmus = resources.root() / "fmus"
    components = {
        name: {"fmu": str(fmus / f"{name}.fmu")} for name in ("vtol", "attitude_controller")
    }
    (line,) = folder.problems(
        components, [connection("vtol.altitude_reference", "attitude_controller.roll_command")]
    )
    assert line.endswith(
        'vtol.altitude_reference cannot feed attitude_controller.roll_command: units "m" and "rad" '
        "measure different quantities"
    )


def test_incompatible_units_and_types_are_refused(folder, probes):
    xml = {"a": {"fmu": str(probes[2])}, "b": {"fmu": str(probes[3])}}
    wires = [
        connection("a.s_out", "b.u"),
        connection("a.b_out", "b.int8_in"),
        connection("b.uint64_out", "a.u"),
        connection("a.i_out", "b.f_in"),
    ]
    hint = ' unless the connection has "convert": true'
    assert [line.split(": ", 2)[2] for line in folder.problems(xml, wires)] == [
        "a.s_out cannot feed b.u: type String cannot be converted to Float64",
        "a.b_out cannot feed b.int8_in: type Boolean cannot be converted to Int8",
        f"b.uint64_out cannot feed a.u: type UInt64 cannot be converted to Float64{hint}",
        f"a.i_out cannot feed b.f_in: type Int32 cannot be converted to Float32{hint}",
    ]


def test_a_prefix_without_a_matching_output_names_the_input(folder):
    components = {"pilot": folder.block("Controller"), "gain": folder.block("Gain")}
    (line,) = folder.problems(
        {**components, "plant": folder.block("Plant")},
        [connection("plant.ship.position", "pilot.vehicle")],
    )
    assert (
        "input pilot.vehicle.position.x has no matching output plant.ship.position.position.x"
        in line
    )


GUST = """
model Gust
  output Real force[3](each unit = "N");
  output Real moment[2](each unit = "N.m");
equation
  force = {1, 0, 0};
  moment = {0, 0};
end Gust;
"""
BODY = """
model Body
  connector Vector
    input Real x(unit = "N");
    input Real y(unit = "N");
    input Real z(unit = "N");
  end Vector;
  connector Position
    output Real x(unit = "m");
    output Real y(unit = "m");
    output Real z(unit = "m");
  end Position;
  Vector external_force;
  Position position;
equation
  position.x = external_force.x;
  position.y = external_force.y;
  position.z = external_force.z;
end Body;
"""


@pytest.fixture
def gust_and_body(folder):
    sources = {"gust": ("Gust", GUST), "body": ("Body", BODY)}
    return {
        key: {"modelica": f"{folder.write(text, f'{name}.mo')}:{name}"}
        for key, (name, text) in sources.items()
    }


def test_an_array_is_proposed_element_by_element_for_a_vector(folder, gust_and_body):
    wires = [connection("gust.force", "body.external_force")]
    (line,) = folder.problems(gust_and_body, wires)
    assert line.partition(": input ")[2] == (
        "body.external_force.x has no matching output gust.force.x; connect gust.force[1] to "
        "body.external_force.x, "
        "gust.force[2] to body.external_force.y, gust.force[3] to body.external_force.z"
    )
    valid = [
        connection(f"gust.force[{i}]", f"body.external_force.{axis}")
        for i, axis in enumerate("xyz", start=1)
    ]
    assert cosim.run(folder.scenario(gust_and_body, valid))["body.position.x"][-1] == 1.0


def test_outputs_of_another_quantity_are_not_proposed(folder, gust_and_body):
    lines = folder.problems(
        {**gust_and_body, "other": gust_and_body["body"]},
        [connection("gust.moment", "body.external_force")],
    )
    assert [line.partition(": input ")[2] for line in lines] == [
        f"body.external_force.{axis} has no matching output gust.moment.{axis}" for axis in "xyz"
    ]
