"""Lowering of subscripts.

Elements and slices of arrays, as values and as targets of assignments.
"""

from __future__ import annotations

from itertools import product
from math import prod

from ....core.text import count_noun
from ..model import syntax_tree
from ..model.syntax_tree import Expression, SourceLocation, raise_model_error
from .c_values import CValue, c_call, linear_index, scalar_value, variable_value
from .lowering import Lowering


class SubscriptLowering(Lowering):
    """Lowering of subscripted expressions such as `a[i]`."""

    def _index(self, node: syntax_tree.Index) -> CValue:
        base = self.lower(node.base)
        return self.select_elements(base, node)

    def select_elements(self, base: CValue, node: syntax_tree.Index) -> CValue:
        """Return the element or slice of an array; it can be the target of an assignment.

        Args:
            base: The array.
            node: The expression with the subscripts.

        Raises:
            InputError: A subscript is not supported, or a constant subscript is out of range.
        """
        if len(node.subscripts) > len(base.shape):
            found = f"found {count_noun(len(node.subscripts), 'subscript')}"
            raise_model_error(f"{found}, expected at most {len(base.shape)}", node.where)
        label = node.base.name if isinstance(node.base, syntax_tree.Name) else "array"
        subscripts = [
            *node.subscripts,
            *[syntax_tree.Colon()] * (len(base.shape) - len(node.subscripts)),
        ]
        offsets = [
            self._element_offsets(s, n, label, node.where)
            for s, n in zip(subscripts, base.shape, strict=True)
        ]
        if any(isinstance(offset, str) for offset in offsets) and base.pointer is None:
            base = variable_value(base.type, base.shape, self.as_c_array(base, base.type))
        offset_lists = [offset if isinstance(offset, list) else [offset] for offset in offsets]
        shape = tuple(len(offset) for offset in offsets if isinstance(offset, list))
        factors = [prod(base.shape[d + 1 :]) for d in range(len(base.shape))]
        selected = [
            linear_index(list(zip(factors, index, strict=True))) for index in product(*offset_lists)
        ]
        if shape == base.shape and selected == list(range(base.size)):
            return base
        if not shape:
            return scalar_value(base.type, base.element(selected[0]), reusable=base.reusable)
        return CValue(
            base.type,
            shape,
            lambda k: base.element(selected[int(k)]),
            indexable_in_loop=False,
            reusable=base.reusable,
        )

    def _element_offsets(
        self,
        subscript: Expression | syntax_tree.Colon,
        size: int,
        label: str,
        where: SourceLocation | None,
    ) -> list[int] | int | str:
        """Return the offset (from 0) of an element as a number or C code, or the offsets of a slice as a list."""
        if isinstance(subscript, syntax_tree.Colon):
            return list(range(size))
        if isinstance(subscript, syntax_tree.Range):
            return [self._check_bounds(k, size, label, where) for k in self.static_range(subscript)]
        if (static := self.static_integer(subscript)) is not None:
            return self._check_bounds(static, size, label, where)
        value = self.lower(subscript)
        if value.shape or value.type == "Boolean":
            raise_model_error(f"this kind of subscript of {label} is not supported", where)
        if value.bounds and value.bounds[0] >= 1 and value.bounds[1] <= size:
            return f"{value.text.code} - 1"
        failure = self.translation_unit.failure_code(f"{label}: subscript outside 1..{size}", where)
        return c_call("element", "m", value.text, str(size), failure).code

    def _check_bounds(
        self, subscript: int, size: int, label: str, where: SourceLocation | None
    ) -> int:
        return (
            subscript - 1
            if 1 <= subscript <= size
            else raise_model_error(f"{label}: subscript {subscript} is outside 1..{size}", where)
        )
