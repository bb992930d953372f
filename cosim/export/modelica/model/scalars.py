"""Scalars of a flat model: variables, and elements of arrays."""

from collections.abc import Iterable, Mapping
from itertools import product
from math import prod
from typing import Any

from .flat_model import Model, Variable
from .syntax_tree import (
    Colon,
    Index,
    Literal,
    Name,
)
from .traversal import read_references

#: a scalar: variable name and row-major index of the element
ScalarKey = tuple[str, int]


def scalar_keys(variables: Mapping[str, Variable], reference: Name | Index) -> set[ScalarKey]:
    """Return the scalars that a reference denotes.

    With a non-literal subscript, all elements of the variable.
    """
    name = reference if isinstance(reference, Name) else reference.base
    if not isinstance(name, Name) or (variable := variables.get(name.name)) is None:
        return set()
    shape = variable.shape
    if isinstance(reference, Name) or not all(
        isinstance(s, Literal | Colon) for s in reference.subscripts
    ):
        return {(name.name, k) for k in range(prod(shape))}
    literals = [int(s.number) - 1 if isinstance(s, Literal) else None for s in reference.subscripts]
    literals += [None] * (len(shape) - len(literals))
    indices = [
        range(n) if k is None else range(k, k + 1) for k, n in zip(literals, shape, strict=False)
    ]
    return {(name.name, _flat_index(index, shape)) for index in product(*indices)}


def _flat_index(index: Iterable[int], shape: Iterable[int]) -> int:
    result = 0
    for k, n in zip(index, shape, strict=True):
        result = result * n + k
    return result


def reference_of(key: ScalarKey, model: Model) -> Name | Index:
    """Return the reference of a scalar."""
    name, number = key
    shape, position = model.variables[name].shape, list[int]()
    for size in reversed(shape):
        position.insert(0, number % size)
        number //= size
    return (
        Index(Name(name), tuple(Literal(k + 1, "Integer") for k in position))
        if shape
        else Name(name)
    )


def scalars_of(model: Model, names: Iterable[str]) -> set[ScalarKey]:
    """Return all scalars of some variables."""
    return scalars_in(model, map(Name, names))


def scalars_in(model: Model, references: Iterable[Name | Index]) -> set[ScalarKey]:
    """Return the scalars that some references denote."""
    return set[ScalarKey]().union(*(scalar_keys(model.variables, each) for each in references))


def scalars_read(model: Model, tree: Any) -> set[ScalarKey]:
    """Return the scalars whose current value a tree reads."""
    return scalars_in(model, read_references(tree))
