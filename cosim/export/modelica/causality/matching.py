"""Maximum matching of equations and unknowns, and strongly connected components.

Equations and unknowns are the two sides of a bipartite graph. A maximum matching assigns to each
equation the unknown that it determines; augmenting paths extend a partial matching (Kuhn 1955).
An equation depends on those that determine its other unknowns. The strongly connected components of
this graph (Tarjan 1972) are the smallest systems that must be solved together, and their order is
that of the solution: the block lower triangular form (Duff and Reid 1978; Cellier and Kofman,
Continuous System Simulation, 2006, chapter 7). Systems are not torn: Newton's method iterates all
unknowns of a component.
"""

from collections.abc import Collection, Hashable, Sequence
from typing import TypeVar

Key = TypeVar("Key", bound=Hashable)


def match(
    candidates: Sequence[Sequence[Key]], optional: Sequence[Collection[Key]] = ()
) -> dict[int, Key]:
    """Assign an unknown to each equation, if possible.

    Assignments without an alternative are made first, so that a system that can be solved in
    sequence is.

    Args:
        candidates: For each equation the unknowns for which it can be solved, the preferred ones
            first.
        optional: Groups of unknowns that have a value anyway. They are assigned only to equations
            that cannot be assigned otherwise, those of the first group first.

    Returns:
        Equation number -> unknown; equations that cannot be matched are missing.
    """
    excluded = set[Key]().union(*optional)
    matched = _match_in_sequence(_without(candidates, excluded))
    owner = {key: number for number, key in matched.items()}
    groups: list[Collection[Key]] = [[], *optional]
    for group in groups:
        excluded -= set(group)
        options = _without(candidates, excluded)
        for number in range(len(options)):
            if number not in matched:
                _augment(number, options, matched, owner)
    return matched


def _without(candidates: Sequence[Sequence[Key]], excluded: set[Key]) -> list[list[Key]]:
    result = []
    for keys in candidates:
        result.append([key for key in keys if key not in excluded])
    return result


def _match_in_sequence(candidates: Sequence[Sequence[Key]]) -> dict[int, Key]:
    """Match the equations and unknowns that leave no choice, as long as there are some.

    An unknown belongs to the only equation that contains it, and an equation to its only free
    unknown.
    """
    equations_of: dict[Key, set[int]] = {}
    for number, keys in enumerate(candidates):
        for key in keys:
            equations_of.setdefault(key, set()).add(number)
    free = [set(keys) for keys in candidates]
    matched: dict[int, Key] = {}

    def assign(number: int, key: Key) -> None:
        matched[number] = key
        for equation in equations_of.pop(key):
            free[equation].discard(key)
        for unknown in free[number]:
            equations_of[unknown].discard(number)
        free[number] = set()

    progress = True
    while progress:
        progress = False
        for number in range(len(candidates)):
            if number not in matched and len(free[number]) == 1:
                assign(number, next(iter(free[number])))
                progress = True
        for key in [key for key, numbers in equations_of.items() if len(numbers) == 1]:
            if key in equations_of and len(equations_of[key]) == 1:
                assign(next(iter(equations_of[key])), key)
                progress = True
    return matched


def _augment(
    start: int, candidates: Sequence[Sequence[Key]], matched: dict[int, Key], owner: dict[Key, int]
) -> None:
    """Find an augmenting path from an unmatched equation by breadth-first search."""
    reached_from: dict[Key, int] = {}
    queue = [start]
    for number in queue:
        for key in candidates[number]:
            if key in reached_from:
                continue
            reached_from[key] = number
            if key in owner:
                queue.append(owner[key])
                continue
            while True:  # exchange the assignments along the path
                number = reached_from[key]
                previous = matched.get(number)
                matched[number], owner[key] = key, number
                if number == start or previous is None:
                    return
                key = previous


def strongly_connected_components(successors: Sequence[Collection[int]]) -> list[list[int]]:
    """Return the strongly connected components of a graph, successors first."""
    index: dict[int, int] = {}
    low: dict[int, int] = {}
    stack: list[int] = []
    on_stack: set[int] = set()
    components: list[list[int]] = []
    for root in range(len(successors)):
        if root in index:
            continue
        work = [(root, iter(sorted(successors[root])))]
        index[root] = low[root] = len(index)
        stack.append(root)
        on_stack.add(root)
        while work:
            node, remaining = work[-1]
            child = next(remaining, None)
            if child is None:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    components.append(_pop_component(node, stack, on_stack))
            elif child not in index:
                index[child] = low[child] = len(index)
                stack.append(child)
                on_stack.add(child)
                work.append((child, iter(sorted(successors[child]))))
            elif child in on_stack:
                low[node] = min(low[node], index[child])
    return components


def _pop_component(node: int, stack: list[int], on_stack: set[int]) -> list[int]:
    component = []
    while True:
        member = stack.pop()
        on_stack.discard(member)
        component.append(member)
        if member == node:
            return sorted(component)
