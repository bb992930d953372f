"""Snapshot and restore a Python object's state in place, so references into it stay valid.

Exported FMUs contain a copy of this file. It imports only the standard library; NumPy objects exist
only if NumPy is imported.
"""

import copy
import random
import sys
from collections.abc import Callable, Collection
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any

Restore = Callable[[], object]

#: types that are immutable or shared, so they are not traversed
_OPAQUE_TYPES = (
    type,
    str,
    bytes,
    int,
    float,
    complex,
    FunctionType,
    BuiltinFunctionType,
    MethodType,
    ModuleType,
)


def snapshot(root: object, exclude: Collection[str] = ()) -> Restore:
    """Save the state of all objects reachable from `root`.

    Attributes, lists, dicts, sets, deques, tuples, NumPy arrays and random generators are
    traversed. Objects that do not expose their state, such as files and iterators, are not saved.

    Args:
        root: The object to save.
        exclude: Names of attributes of `root` that are neither saved nor restored.

    Returns:
        A function that restores the saved state in place; it may be called repeatedly.
    """
    restores: list[Restore] = []
    _snapshot_object(root, restores, set(), exclude)

    def restore_all() -> None:
        for restore in restores:
            restore()

    return restore_all


def _snapshot_object(
    target: Any, restores: list[Restore], visited: set[int], exclude: Collection[str] = ()
) -> None:
    if id(target) in visited or isinstance(target, _OPAQUE_TYPES):
        return
    visited.add(id(target))
    parts: list[Any] = []
    numpy: Any = sys.modules.get("numpy")
    if numpy and isinstance(target, numpy.ndarray):
        if target.flags.writeable:
            values = target.copy()
            restores.append(lambda: target.__setitem__(..., values))
        parts = target.ravel().tolist() if target.dtype.hasobject else []
    elif isinstance(target, random.Random):
        state = target.getstate()
        restores.append(lambda: target.setstate(state))
    elif numpy and isinstance(target, numpy.random.Generator):
        bit_generator, bit_state = target.bit_generator, copy.deepcopy(target.bit_generator.state)
        restores.append(lambda: setattr(bit_generator, "state", bit_state))
    elif isinstance(target, tuple):
        parts = list(target)
    elif hasattr(target, "clear") and isinstance(target, Collection):
        parts = _snapshot_members(target, restores)
    parts += _snapshot_attributes(target, restores, exclude)
    for part in parts:
        _snapshot_object(part, restores, visited)


def _snapshot_members(container: Any, restores: list[Restore]) -> list[Any]:
    """Save the members of a dict, list, deque or set, and return them."""
    refill = next(
        (getattr(container, name) for name in ("update", "extend") if hasattr(container, name)),
        None,
    )
    if refill is None:
        return []
    members = dict(container) if hasattr(container, "items") else list(container)

    def restore() -> None:
        container.clear()
        refill(members)

    restores.append(restore)
    return [*members.values()] if isinstance(members, dict) else members


def _snapshot_attributes(
    target: Any, restores: list[Restore], exclude: Collection[str]
) -> list[Any]:
    """Save the attributes of an object, and return their values."""
    if not hasattr(target, "__dict__"):
        return []
    attributes = vars(target)
    saved = {name: value for name, value in attributes.items() if name not in exclude}

    def restore() -> None:
        for name in attributes.keys() - saved.keys() - set(exclude):
            del attributes[name]
        attributes.update(saved)

    restores.append(restore)
    return list(saved.values())
