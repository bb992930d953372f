"""Modelica functions as C functions: one for each combination of argument shapes, so that all sizes are constants."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ..model import flat_model
from ..model.flat_model import Function, FunctionVariable, SourceLocation, raise_model_error, referenced_variable
from ..model.traversal import read_references
from .c_values import C_TYPES, CValue, c_identifier, variable_value
from .formatting import uses_variable, wrap_lines
from .lowering import FunctionInstance
from .statements import StatementLowering

Shapes = tuple[tuple[int, ...], ...]


@dataclass
class FunctionTranslator:
    """The C functions that the calls of a model have asked for so far; `texts` holds them in order of definition."""

    functions: dict[str, Function]
    failure_code: Callable[[str, SourceLocation | None], str]
    definitions: list[str] = field(default_factory=list)
    _instances: dict[tuple[str, Shapes], FunctionInstance] = field(default_factory=dict)
    _in_translation: list[str] = field(default_factory=list)

    def function_instance(self, call: flat_model.Call, shapes: Shapes) -> FunctionInstance:
        """The C function for this call; translated at the first call with arguments of these shapes."""
        key = (call.function, shapes)
        if key not in self._instances:
            if call.function in self._in_translation:
                raise_model_error(f"the recursive function {call.function} is not supported", call.where)
            if call.function not in self.functions:
                raise_model_error(f"unknown function {call.function}", call.where)
            self._in_translation.append(call.function)
            self._instances[key] = self._translate(self.functions[call.function], shapes, call.where)
            self._in_translation.pop()
        return self._instances[key]

    def _translate(self, function: Function, shapes: Shapes, where: SourceLocation | None) -> FunctionInstance:
        if len(shapes) != len(function.inputs):
            raise_model_error(f"{function.name} takes {len(function.inputs)} arguments, not {len(shapes)}", where)
        lowering = StatementLowering(self, {})
        inputs = [self._declare(lowering, local, shape, where) for local, shape in zip(function.inputs, shapes, strict=True)]
        outputs = [self._declare(lowering, local, None, where) for local in function.outputs]
        inner = [self._declare(lowering, local, None, where) for local in function.locals]
        self._initialize_variables(lowering, (*function.outputs, *function.locals))
        lowering.body(function.body)
        instance = FunctionInstance(self._name(function.name), tuple(inputs), tuple(outputs), uses_variable("m", lowering.lines))
        self.definitions.append(_function_text(function, instance, inner, lowering.lines))
        return instance

    def _declare(
        self, lowering: StatementLowering, local: FunctionVariable, shape: tuple[int, ...] | None, where: SourceLocation | None
    ) -> CValue:
        """Puts a variable of the function into its scope."""
        if local.type not in C_TYPES:
            raise_model_error(f"{local.name}: the type {local.type} is not supported", local.where)
        declared = [None if d is None else lowering.static_integer(d) for d in local.dimensions]
        unknown = [d for d, n in zip(local.dimensions, declared, strict=True) if n is None and (shape is None or d is not None)]
        if unknown:
            raise_model_error(f"the size of {local.name} must be constant, or the size() of an input", local.where)
        actual = tuple(declared) if shape is None else shape
        if len(actual) != len(declared) or any(n not in (None, k) for n, k in zip(declared, actual, strict=True)):
            raise_model_error(f"the argument for {local.name} has the wrong size {list(actual)}", where)
        value = variable_value(local.type, actual, c_identifier(local.name))  # type: ignore[arg-type]
        lowering.scope[local.name] = value
        return value

    def _initialize_variables(self, lowering: StatementLowering, variables: tuple[FunctionVariable, ...]) -> None:
        for local in variables:
            if local.default is not None:
                lowering.store(lowering.scope[local.name], local.default, flat_model.Name(local.name))

    def _name(self, name: str) -> str:
        plain = c_identifier(name) if "." in name else c_identifier(name) + "_"
        taken = {instance.name for instance in self._instances.values()}
        return next(n for n in (plain, *(f"{plain}_{k}" for k in range(2, len(taken) + 3))) if n not in taken)


def _function_text(function: Function, instance: FunctionInstance, inner: list[CValue], body: list[str]) -> str:
    """The whole C function; results that do not fit into a return value go through pointers."""
    inputs = [_parameter(value, "const ") for value in instance.inputs]
    results = [] if instance.returns_scalar else [_result_parameter(value) for value in instance.outputs]
    parameters = ", ".join([*["Model *m"] * instance.takes_model, *inputs, *results]) or "void"
    lines = [*_opening_lines(function, instance, inner, body), *body, *_closing_lines(instance)]
    return "\n".join(
        [
            f"/* {function.name} ({function.where.file_and_line if function.where else 'no source'}) */",
            f"static {C_TYPES[instance.outputs[0].type] if instance.returns_scalar else 'void'} {instance.name}({parameters})",
            "{",
            *wrap_lines(lines),
            "}",
        ]
    )


def _opening_lines(function: Function, instance: FunctionInstance, inner: list[CValue], body: list[str]) -> list[str]:
    """Declarations, and a (void) for what C would call unused."""
    lines = [
        _declaration(output) if instance.returns_scalar or not output.shape else _zero_fill(output) for output in instance.outputs
    ]
    used = [
        (value, local.name) for value, local in zip(inner, function.locals, strict=True) if uses_variable(_c_name(value), body)
    ]
    lines += [_declaration(value) for value, _ in used]
    read = {referenced_variable(reference) for reference in read_references(function.body)}
    unread = [value for value in instance.inputs if not uses_variable(_c_name(value), body)]
    return [*lines, *(f"(void){_c_name(value)};" for value in (*unread, *(value for value, name in used if name not in read)))]


def _closing_lines(instance: FunctionInstance) -> list[str]:
    if instance.returns_scalar:
        return [f"return {instance.outputs[0].text.code};"]
    return [f"*{output.text.code}_result = {output.text.code};" for output in instance.outputs if not output.shape]


def _result_parameter(value: CValue) -> str:
    return _parameter(value, "") if value.shape else f"{C_TYPES[value.type]} *{value.text.code}_result"


def _c_name(value: CValue) -> str:
    return value.pointer or value.text.code


def _parameter(value: CValue, qualifier: str) -> str:
    size = f"[{value.size}]" if value.shape else ""
    return f"{qualifier if value.shape else ''}{C_TYPES[value.type]} {_c_name(value)}{size}"


def _zero_fill(value: CValue) -> str:
    return f"memset({value.pointer}, 0, {value.size} * sizeof *{value.pointer});"


def _declaration(value: CValue) -> str:
    return f"{C_TYPES[value.type]} {_c_name(value)}{f'[{value.size}] = {{0}}' if value.shape else ' = 0'};"
