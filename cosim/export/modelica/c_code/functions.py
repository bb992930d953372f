"""Modelica functions as C functions: one for each combination of argument shapes, so that all sizes are constants."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ..model import flat_model
from ..model.flat_model import Function, Local, Place, base_name, refuse
from ..model.traversal import reads
from .c_values import C_TYPES, Value, identifier, stored
from .layout import mentions, wrapped
from .lowering import Instance
from .statements import Statements

Shapes = tuple[tuple[int, ...], ...]


@dataclass
class Functions:
    """The C functions that the calls of a model have asked for so far; `texts` holds them in order of definition."""

    functions: dict[str, Function]
    failure: Callable[[str, Place | None], str]
    texts: list[str] = field(default_factory=list)
    _instances: dict[tuple[str, Shapes], Instance] = field(default_factory=dict)
    _open: list[str] = field(default_factory=list)

    def function(self, call: flat_model.Call, shapes: Shapes) -> Instance:
        """The C function for this call; translated at the first call with arguments of these shapes."""
        key = (call.function, shapes)
        if key not in self._instances:
            if call.function in self._open:
                refuse(f"the recursive function {call.function} is not supported", call.where)
            if call.function not in self.functions:
                refuse(f"unknown function {call.function}", call.where)
            self._open.append(call.function)
            self._instances[key] = self._translate(self.functions[call.function], shapes, call.where)
            self._open.pop()
        return self._instances[key]

    def _translate(self, function: Function, shapes: Shapes, where: Place | None) -> Instance:
        if len(shapes) != len(function.inputs):
            refuse(f"{function.name} takes {len(function.inputs)} arguments, not {len(shapes)}", where)
        lowering = Statements(self, {})
        inputs = [self._declare(lowering, local, shape, where) for local, shape in zip(function.inputs, shapes, strict=True)]
        outputs = [self._declare(lowering, local, None, where) for local in function.outputs]
        inner = [self._declare(lowering, local, None, where) for local in function.locals]
        self._start(lowering, (*function.outputs, *function.locals))
        lowering.body(function.body)
        instance = Instance(self._name(function.name), tuple(inputs), tuple(outputs), mentions("m", lowering.out))
        self.texts.append(_text(function, instance, inner, lowering.out))
        return instance

    def _declare(self, lowering: Statements, local: Local, shape: tuple[int, ...] | None, where: Place | None) -> Value:
        """Puts a variable of the function into its scope."""
        if local.type not in C_TYPES:
            refuse(f"{local.name}: the type {local.type} is not supported", local.where)
        declared = [None if d is None else lowering.static_integer(d) for d in local.dimensions]
        unknown = [d for d, n in zip(local.dimensions, declared, strict=True) if n is None and (shape is None or d is not None)]
        if unknown:
            refuse(f"the size of {local.name} must be constant, or the size() of an input", local.where)
        actual = tuple(declared) if shape is None else shape
        if len(actual) != len(declared) or any(n not in (None, k) for n, k in zip(declared, actual, strict=True)):
            refuse(f"the argument for {local.name} has the wrong size {list(actual)}", where)
        value = stored(local.type, actual, identifier(local.name))  # type: ignore[arg-type]
        lowering.scope[local.name] = value
        return value

    def _start(self, lowering: Statements, variables: tuple[Local, ...]) -> None:
        for local in variables:
            if local.default is not None:
                lowering.store(lowering.scope[local.name], local.default, flat_model.Name(local.name))

    def _name(self, name: str) -> str:
        plain = identifier(name) if "." in name else identifier(name) + "_"
        taken = {instance.name for instance in self._instances.values()}
        return next(n for n in (plain, *(f"{plain}_{k}" for k in range(2, len(taken) + 3))) if n not in taken)


def _text(function: Function, instance: Instance, inner: list[Value], body: list[str]) -> str:
    """The whole C function; results that do not fit into a return value go through pointers."""
    inputs = [_parameter(value, "const ") for value in instance.inputs]
    results = [] if instance.returns else [_result(value) for value in instance.outputs]
    parameters = ", ".join([*["Model *m"] * instance.takes_model, *inputs, *results]) or "void"
    lines = [*_start(function, instance, inner, body), *body, *_end(instance)]
    return "\n".join(
        [
            f"/* {function.name} ({function.where.short if function.where else 'no source'}) */",
            f"static {C_TYPES[instance.outputs[0].type] if instance.returns else 'void'} {instance.name}({parameters})",
            "{",
            *wrapped(lines),
            "}",
        ]
    )


def _start(function: Function, instance: Instance, inner: list[Value], body: list[str]) -> list[str]:
    """Declarations, and a (void) for what C would call unused."""
    lines = [_declaration(output) if instance.returns or not output.shape else _cleared(output) for output in instance.outputs]
    used = [(value, local.name) for value, local in zip(inner, function.locals, strict=True) if mentions(_code(value), body)]
    lines += [_declaration(value) for value, _ in used]
    read = {base_name(reference) for reference in reads(function.body)}
    unread = [value for value in instance.inputs if not mentions(_code(value), body)]
    return [*lines, *(f"(void){_code(value)};" for value in (*unread, *(value for value, name in used if name not in read)))]


def _end(instance: Instance) -> list[str]:
    if instance.returns:
        return [f"return {instance.outputs[0].text.code};"]
    return [f"*{output.text.code}_result = {output.text.code};" for output in instance.outputs if not output.shape]


def _result(value: Value) -> str:
    return _parameter(value, "") if value.shape else f"{C_TYPES[value.type]} *{value.text.code}_result"


def _code(value: Value) -> str:
    return value.pointer or value.text.code


def _parameter(value: Value, qualifier: str) -> str:
    size = f"[{value.size}]" if value.shape else ""
    return f"{qualifier if value.shape else ''}{C_TYPES[value.type]} {_code(value)}{size}"


def _cleared(value: Value) -> str:
    return f"memset({value.pointer}, 0, {value.size} * sizeof *{value.pointer});"


def _declaration(value: Value) -> str:
    return f"{C_TYPES[value.type]} {_code(value)}{f'[{value.size}] = {{0}}' if value.shape else ' = 0'};"
