"""Order of the nodes of a graph."""

import random

import pytest

from cosim.core.graph import ordered_groups


def test_groups_are_ordered_by_their_dependencies_and_else_as_listed():
    predecessors = {"d": "c", "c": "bd", "a": "", "b": "a", "e": ""}
    assert ordered_groups(predecessors) == [["a"], ["b"], ["d", "c"], ["e"]]
    assert ordered_groups({"b": "", "a": ""}) == [["b"], ["a"]]


@pytest.mark.parametrize("seed", range(20))
def test_the_next_group_is_the_first_listed_one_whose_predecessors_are_placed(seed):
    generator = random.Random(seed)  # noqa: S311
    nodes = generator.sample(range(30), 30)
    predecessors = {node: generator.sample(nodes, generator.choice([0, 0, 1, 2])) for node in nodes}
    groups = ordered_groups(predecessors)
    waiting, placed = list(nodes), set()
    for group in groups:
        first = next(node for node in waiting if _is_ready(node, groups, predecessors, placed))
        assert first == group[0]
        waiting = [node for node in waiting if node not in group]
        placed |= set(group)
    assert not waiting


def _is_ready(node, groups, predecessors, placed):
    """Return whether all predecessors of the group of a node are placed or in the group."""
    (group,) = (each for each in groups if node in each)
    return all(placed.union(group).issuperset(predecessors[each]) for each in group)
