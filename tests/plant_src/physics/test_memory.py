"""Where the numbers of the vehicles lie."""

from __future__ import annotations

from plant_src.physics.memory import Memory


def test_a_piece_holds_the_numbers_of_all_vehicles_in_order() -> None:
    memory = Memory([{"inputs": 2, "torque": 3}, {"inputs": 1}])
    memory.parts[0]["inputs"][:] = [1.0, 2.0]
    memory.parts[1]["inputs"][:] = 3.0
    assert memory.whole["inputs"].tolist() == [1.0, 2.0, 3.0]
    assert list(memory.parts[1]) == ["inputs"]


def test_the_block_is_everything() -> None:
    memory = Memory([{"a": 2, "b": 1}, {"b": 2}])
    saved = memory.block.copy()
    memory.whole["a"][:] = 1.0
    memory.parts[1]["b"][:] = 2.0
    assert sorted(memory.block.tolist()) == [0.0, 1.0, 1.0, 2.0, 2.0]
    memory.block[:] = saved
    assert not memory.whole["a"].any() and not memory.parts[1]["b"].any()
