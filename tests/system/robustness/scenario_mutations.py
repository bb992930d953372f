"""Strategies that change scenarios: keys and values dropped, renamed, moved, doubled, or replaced
by telling ones.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from typing import Any

from hypothesis import strategies as st

Path_ = tuple[Any, ...]

#: what stands in scenarios by mistake or malice; text of a file is written from them by
#: `json.dumps`, so NaN too
ODD_VALUES = (None, True, False, "", 0, -1, 1.5, -0.0, [], {}, [[]], [None], {"": None})
NUMBERS = (
    "NaN",
    "1/0",
    "1/60",
    "-1/3",
    "1e400",
    "0x10",
    "1e999999999",
    "9" * 5000,
    "1_0",
    float("nan"),
    float("inf"),
)
LARGE_NUMBERS = (1e308, 5e-324, 10**18, 10**400, 2**63, -(2**63) - 1)
NAMES = (
    "a",
    "a.y",
    "inner.x",
    "b.u",
    "*",
    "**",
    ".",
    "..",
    "a.",
    ".y",
    "a.y.z",
    "a[1]",
    "a[",
    "$",
    "x" * 300,
)
CHARACTERS = ("\0", "\ud800", "é", "\n", "\u202e")
FILES = (
    "/",
    "/dev/null",
    "/dev/zero",
    "/proc/self/mem",
    "scenario.json",
    "inner.json",
    "pythonfmu_blocks.py",
    "probe.fmu",
    "profile.csv",
)
FUNCTIONS = (
    "pythonfmu_blocks.py:",
    ":Gain",
    "pythonfmu_blocks.py:Gain",
    "pythonfmu_blocks.py:Missing",
    "pythonfmu_blocks.py:__name__",
    "../pythonfmu_blocks.py:Gain",
    "kpis.py:last",
)
SUSPICIOUS_VALUES = st.sampled_from(
    (*ODD_VALUES, *NUMBERS, *LARGE_NUMBERS, *NAMES, *CHARACTERS, *FILES, *FUNCTIONS)
)
SCALARS = st.one_of(
    st.integers(), st.floats(), st.text(max_size=8), st.booleans(), SUSPICIOUS_VALUES
)
VALUES = st.one_of(
    SUSPICIOUS_VALUES,
    st.recursive(
        SCALARS,
        lambda inner: (
            st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3)
        ),
    ),
)


def all_paths(value: Any, path: Path_ = ()) -> Iterator[Path_]:
    """The paths of everything below a JSON value."""
    if not isinstance(value, dict | list):
        return
    for key, element in value.items() if isinstance(value, dict) else enumerate(value):
        yield (*path, key)
        yield from all_paths(element, (*path, key))


def value_at(value: Any, path: Path_) -> Any:
    for key in path:
        value = value[key]
    return value


def _drop(_draw: Callable[..., Any], document: Any, path: Path_) -> None:
    del value_at(document, path[:-1])[path[-1]]


def _replace(draw: Callable[..., Any], document: Any, path: Path_) -> None:
    value_at(document, path[:-1])[path[-1]] = copy.deepcopy(
        draw(VALUES)
    )  # what is changed next must not be the list in TELLING


def _rename(draw: Callable[..., Any], document: Any, path: Path_) -> None:
    parent = value_at(document, path[:-1])
    if isinstance(parent, dict):
        key = str(path[-1])
        parent[
            draw(
                st.sampled_from([key[:-1], key + "s", key.upper(), key[::-1], "", "a.b", "\ud800"])
            )
        ] = parent.pop(key)


def _duplicate(_draw: Callable[..., Any], document: Any, path: Path_) -> None:
    parent = value_at(document, path[:-1])
    if isinstance(parent, list):
        parent.insert(path[-1], copy.deepcopy(parent[path[-1]]))
    else:
        parent[f"{path[-1]}2"] = copy.deepcopy(parent[path[-1]])


def _swap(draw: Callable[..., Any], document: Any, path: Path_) -> None:
    """A value of another place of the same document."""
    other = draw(st.sampled_from(list(all_paths(document))))
    value_at(document, path[:-1])[path[-1]] = copy.deepcopy(value_at(document, other))


def _nest(draw: Callable[..., Any], document: Any, path: Path_) -> None:
    value = value_at(document, path)
    for _ in range(draw(st.sampled_from([1, 3, 99, 150]))):
        value = [value] if draw(st.booleans()) else {"x": value}
    value_at(document, path[:-1])[path[-1]] = value


def _retype(draw: Callable[..., Any], document: Any, path: Path_) -> None:
    value = value_at(document, path)
    value_at(document, path[:-1])[path[-1]] = draw(
        st.sampled_from([str(value), [value], {"value": value}, bool(value)])
    )


def _scale(draw: Callable[..., Any], document: Any, path: Path_) -> None:
    value = value_at(document, path)
    if isinstance(value, int | float) and not isinstance(value, bool):
        value_at(document, path[:-1])[path[-1]] = value * draw(
            st.sampled_from([-1, 0, 0.3, 1e9, 1e300, 10**30])
        )


OPERATIONS = (_drop, _replace, _replace, _rename, _duplicate, _swap, _nest, _retype, _scale)


@st.composite
def mutants(draw: Callable[..., Any], document: Any) -> Any:
    """The document after one to three changes."""
    changed = copy.deepcopy(document)
    for _ in range(draw(st.integers(1, 3))):
        if paths := list(all_paths(changed)):
            operation = draw(st.sampled_from(OPERATIONS))
            operation(draw, changed, draw(st.sampled_from(paths)))
    return changed
