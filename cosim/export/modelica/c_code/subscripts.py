"""Subscripts: elements and parts of arrays, as values and as targets of assignments."""

from __future__ import annotations

from itertools import product
from math import prod

from ..model import flat_model
from ..model.flat_model import Expression, SourceLocation, raise_model_error
from .c_values import CValue, c_call, linear_index, variable_value
from .lowering import Lowering


class SubscriptLowering(Lowering):
    """Adds `a[i]` to a lowering."""

    def _index(self, node: flat_model.Index) -> CValue:
        base = self.lower(node.base)
        return self.select_elements(base, node)

    def select_elements(self, base: CValue, node: flat_model.Index) -> CValue:
        """The element or the part of an array that subscripts name; also as the target of an assignment."""
        if len(node.subscripts) > len(base.shape):
            raise_model_error("more subscripts than dimensions", node.where)
        label = node.base.name if isinstance(node.base, flat_model.Name) else "array"
        subscripts = [*node.subscripts, *[flat_model.Colon()] * (len(base.shape) - len(node.subscripts))]
        places = [self._element_offsets(s, n, label, node.where) for s, n in zip(subscripts, base.shape, strict=True)]
        if any(isinstance(place, str) for place in places) and base.pointer is None:
            base = variable_value(base.type, base.shape, self.as_c_array(base, base.type))
        choices = [place if isinstance(place, list) else [place] for place in places]
        shape = tuple(len(place) for place in places if isinstance(place, list))
        factors = [prod(base.shape[d + 1 :]) for d in range(len(base.shape))]
        selected = [linear_index(list(zip(factors, index, strict=True))) for index in product(*choices)]
        if shape == base.shape and selected == list(range(base.size)):
            return base
        return CValue(base.type, shape, lambda k: base.element(selected[int(k)]), indexable_in_loop=False, reusable=base.reusable)

    def _element_offsets(
        self, subscript: Expression | flat_model.Colon, size: int, label: str, where: SourceLocation | None
    ) -> list[int] | int | str:
        """Places counted from 0: several for a slice, a number or C text for one element."""
        if isinstance(subscript, flat_model.Colon):
            return list(range(size))
        if isinstance(subscript, flat_model.Range):
            return [self._check_bounds(k, size, label, where) for k in self.static_range(subscript)]
        if (fixed := self.static_integer(subscript)) is not None:
            return self._check_bounds(fixed, size, label, where)
        value = self.lower(subscript)
        if value.shape or value.type == "Boolean":
            raise_model_error(f"this kind of subscript of {label} is not supported", where)
        if value.bounds and value.bounds[0] >= 1 and value.bounds[1] <= size:
            return f"{value.text.code} - 1"
        failure = self.translation_unit.failure_code(f"{label}: subscript outside 1..{size}", where)
        return c_call("element", "m", value.text, str(size), failure).code

    def _check_bounds(self, subscript: int, size: int, label: str, where: SourceLocation | None) -> int:
        return (
            subscript - 1
            if 1 <= subscript <= size
            else raise_model_error(f"{label}: subscript {subscript} is outside 1..{size}", where)
        )
