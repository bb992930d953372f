"""Order of the nodes of a directed graph that may have cycles."""

from collections.abc import Hashable, Iterable, Iterator, Mapping
from heapq import heapify, heappop, heappush
from typing import TypeVar

T = TypeVar("T", bound=Hashable)


def strong_components(successors: Mapping[T, Iterable[T]]) -> list[list[T]]:
    """Return the strongly connected components in reverse topological order.

    Tarjan's algorithm (1972) without recursion: a depth-first search numbers the nodes (`index`).
    `low` is the smallest number that a node reaches through its subtree and one edge back to a node
    on the stack. A node with low == index is the first one of its component, which lies above it on
    the stack.

    Args:
        successors: Successors of every node; nodes that are not keys are ignored.
    """
    index: dict[T, int] = {}
    low: dict[T, int] = {}
    stack: list[T] = []
    on_stack: set[T] = set()
    components: list[list[T]] = []

    def enter(node: T) -> tuple[T, Iterator[T]]:
        index[node] = low[node] = len(index)
        stack.append(node)
        on_stack.add(node)
        return node, iter(successors[node])

    for root in successors:
        path = [] if root in index else [enter(root)]
        while path:
            node, rest = path[-1]
            following = next(
                (
                    other
                    for other in rest
                    if other in successors and (other not in index or other in on_stack)
                ),
                None,
            )
            if following is None:
                path.pop()
                if path:
                    low[path[-1][0]] = min(low[path[-1][0]], low[node])
                if low[node] == index[node]:
                    begin = stack.index(node)
                    components.append(stack[begin:])
                    on_stack.difference_update(stack[begin:])
                    del stack[begin:]
            elif following in on_stack:
                low[node] = min(low[node], index[following])
            else:
                path.append(enter(following))
    return components


def ordered_groups(predecessors: Mapping[T, Iterable[T]]) -> list[list[T]]:
    """Return groups of nodes that depend on each other, each group after those that it depends on.

    Args:
        predecessors: Nodes that every node depends on. The order of the nodes decides wherever
            their dependencies do not.
    """
    position = {node: i for i, node in enumerate(predecessors)}
    groups = [sorted(group, key=position.__getitem__) for group in strong_components(predecessors)]
    number: dict[T, int] = {}
    for k, group in enumerate(groups):
        number |= dict.fromkeys(group, k)
    followers: list[list[int]] = [[] for _ in groups]
    waiting = []
    for k, group in enumerate(groups):
        needed = set()
        for node in group:
            needed |= {number[p] for p in predecessors[node] if p in number}
        needed.discard(k)
        for other in needed:
            followers[other].append(k)
        waiting.append(len(needed))
    ready = [(position[groups[k][0]], k) for k, count in enumerate(waiting) if not count]
    heapify(ready)
    result = []
    while ready:
        _, k = heappop(ready)
        result.append(groups[k])
        for follower in followers[k]:
            waiting[follower] -= 1
            if not waiting[follower]:
                heappush(ready, (position[groups[follower][0]], follower))
    return result
