"""Arrays of all vehicles in one buffer."""

from __future__ import annotations

from plant_src.physics.fleet import VehicleArrays


def test_an_array_holds_the_numbers_of_all_vehicles_in_order() -> None:
    memory = VehicleArrays([{"inputs": 2, "torque": 3}, {"inputs": 1}])
    memory.of_vehicle[0]["inputs"][:] = [1.0, 2.0]
    memory.of_vehicle[1]["inputs"][:] = 3.0
    assert memory.of_all_vehicles["inputs"].tolist() == [1.0, 2.0, 3.0]
    assert list(memory.of_vehicle[1]) == ["inputs"]


def test_the_buffer_holds_all_arrays() -> None:
    memory = VehicleArrays([{"a": 2, "b": 1}, {"b": 2}])
    saved = memory.buffer.copy()
    memory.of_all_vehicles["a"][:] = 1.0
    memory.of_vehicle[1]["b"][:] = 2.0
    assert sorted(memory.buffer.tolist()) == [0.0, 1.0, 1.0, 2.0, 2.0]
    memory.buffer[:] = saved
    assert not memory.of_all_vehicles["a"].any()
    assert not memory.of_vehicle[1]["b"].any()
