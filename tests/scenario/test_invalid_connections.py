"""Invalid connections: units, types and prefixes."""

from systems import connection

from cosim.core import resources


def test_units_of_different_quantities_are_refused(folder):
    fmus = resources.root() / "fmus"
    components = {name: {"fmu": str(fmus / f"{name}.fmu")} for name in ("vtol", "attitude_controller")}
    (line,) = folder.problems(components, [connection("vtol.altitude_reference", "attitude_controller.roll_command")])
    assert line.endswith(
        'vtol.altitude_reference cannot feed attitude_controller.roll_command: units "m" and "rad" measure different quantities'
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
        {**components, "plant": folder.block("Plant")}, [connection("plant.ship.position", "pilot.vehicle")]
    )
    assert "input pilot.vehicle.position.x has no matching output plant.ship.position.position.x" in line
