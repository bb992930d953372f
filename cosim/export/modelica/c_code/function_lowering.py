"""Code generation for Modelica functions.

One C function per combination of argument shapes, so that all sizes are constant.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from ..model.flat_model import Function, FunctionVariable
from ..model.syntax_tree import (
    Assert,
    Call,
    Literal,
    Name,
    SourceLocation,
    raise_model_error,
    referenced_variable,
)
from ..model.traversal import read_references, rewrite, variable_names, walk
from .c_values import C_TYPES, CValue, c_identifier, uses_variable, variable_value, wrap_lines
from .lowering import FunctionInstance
from .statement_lowering import StatementLowering

Shapes = tuple[tuple[int, ...], ...]
Sizes = tuple[tuple[str, int], ...]


@dataclass
class FunctionTranslator:
    """Translator of the functions that a model calls to C; it implements `TranslationUnit`."""

    functions: dict[str, Function]
    #: returns the number of a failure reason, for the C code
    failure_code: Callable[[str, SourceLocation | None], str]
    #: definitions of the translated functions, each after those that it calls
    definitions: list[str] = field(default_factory=list)
    _instances: dict[tuple[str, Shapes, Sizes], FunctionInstance] = field(default_factory=dict)
    _in_translation: list[str] = field(default_factory=list)

    #: assertions with the level warning, in the order of their numbers
    warnings: list[Assert] = field(default_factory=list)

    def warning_number(self, node: Assert) -> int:
        """Return the number of an assertion with the level warning."""
        if node not in self.warnings:
            self.warnings.append(node)
        return self.warnings.index(node)

    def function_instance(
        self, call: Call, shapes: Shapes, numbers: tuple[int | None, ...]
    ) -> FunctionInstance:
        """Return the C function for a call.

        It is translated at the first call with arguments of these shapes.

        Args:
            call: The call.
            shapes: Shapes of the arguments.
            numbers: Values of the constant Integer arguments; they can determine the sizes of
                variables of the function.

        Raises:
            InputError: The function is recursive, unknown, or uses an unsupported feature.
        """
        if call.function not in self.functions:
            raise_model_error(f"unknown function {call.function}", call.where)
        function, sizes = _with_sizes(self.functions[call.function], numbers)
        key = (call.function, shapes, sizes)
        if key not in self._instances:
            if call.function in self._in_translation:
                raise_model_error(
                    f"the recursive function {call.function} is not supported", call.where
                )
            self._in_translation.append(call.function)
            self._instances[key] = self._translate(function, shapes, call.where)
            self._in_translation.pop()
        return self._instances[key]

    @property
    def external_functions(self) -> list[Function]:
        """External functions that are called."""
        names = dict.fromkeys(name for name, _, _ in self._instances)
        return [self.functions[name] for name in names if self.functions[name].external]

    def _translate(
        self, function: Function, shapes: Shapes, where: SourceLocation | None
    ) -> FunctionInstance:
        if len(shapes) != len(function.inputs):
            raise_model_error(
                f"{function.name}: found {len(shapes)} arguments, expected {len(function.inputs)}",
                where,
            )
        lowering = StatementLowering(self, {}, function=function.name)
        inputs = [
            self._declare(lowering, local, shape, where)
            for local, shape in zip(function.inputs, shapes, strict=True)
        ]
        outputs = [self._declare(lowering, local, None, where) for local in function.outputs]
        local_values = [self._declare(lowering, local, None, where) for local in function.locals]
        for local in (*function.outputs, *function.locals):
            if local.default is not None:
                lowering.store(lowering.scope[local.name], local.default, Name(local.name))
        lowering.body(function.body)
        instance = FunctionInstance(
            self._name(function.name),
            tuple(inputs),
            tuple(outputs),
            uses_variable("m", lowering.lines),
        )
        self.definitions.append(_function_text(function, instance, local_values, lowering.lines))
        return instance

    def _declare(
        self,
        lowering: StatementLowering,
        local: FunctionVariable,
        shape: tuple[int, ...] | None,
        where: SourceLocation | None,
    ) -> CValue:
        """Add a variable of the function to its scope.

        `shape` is that of the argument of an input, else None.
        """
        if local.type not in C_TYPES:
            raise_model_error(f"{local.name}: the type {local.type} is not supported", local.where)
        declared = [None if d is None else lowering.static_integer(d) for d in local.dimensions]
        unknown = [
            d
            for d, n in zip(local.dimensions, declared, strict=True)
            if n is None and (shape is None or d is not None)
        ]
        if unknown:
            raise_model_error(
                f"the size of {local.name} must be constant, or the size() of an input", local.where
            )
        actual = tuple(n for n in declared if n is not None) if shape is None else shape
        if len(actual) != len(declared) or any(
            n not in (None, k) for n, k in zip(declared, actual, strict=True)
        ):
            expected = ", ".join(":" if n is None else str(n) for n in declared)
            raise_model_error(
                f"the argument for {local.name}: found size {list(actual)}, expected [{expected}]",
                where,
            )
        value = variable_value(local.type, actual, c_identifier(local.name.replace(".", "__")))
        lowering.scope[local.name] = value
        return value

    def _name(self, name: str) -> str:
        base = c_identifier(name) if "." in name else c_identifier(name) + "_"
        used = {instance.name for instance in self._instances.values()}
        result, number = base, 1
        while result in used:
            number += 1
            result = f"{base}_{number}"
        return result


def _with_sizes(function: Function, numbers: tuple[int | None, ...]) -> tuple[Function, Sizes]:
    """Insert the values of constant Integer arguments that determine sizes.

    The sizes are those of the function, or of functions that it calls.

    Returns:
        The function, and the names and values of these arguments.
    """
    used = variable_names(
        tuple(local.dimensions for local in (*function.outputs, *function.locals))
    )
    used |= variable_names(tuple(n.arguments for n in walk(function.body) if isinstance(n, Call)))
    sizes = tuple(
        (i.name, n)
        for i, n in zip(function.inputs, numbers, strict=False)
        if n is not None and i.name in used
    )
    literals = {name: Literal(number, "Integer") for name, number in sizes}

    def insert(node: Any) -> Any:
        return literals.get(node.name, node) if isinstance(node, Name) else node

    def resize(local: FunctionVariable) -> FunctionVariable:
        return replace(
            local,
            dimensions=rewrite(local.dimensions, insert),
            default=rewrite(local.default, insert),
        )

    outputs, local_variables = (
        tuple(map(resize, function.outputs)),
        tuple(map(resize, function.locals)),
    )
    return replace(
        function, outputs=outputs, locals=local_variables, body=rewrite(function.body, insert)
    ), sizes


def _function_text(
    function: Function, instance: FunctionInstance, local_values: list[CValue], body: list[str]
) -> str:
    """Return the definition of a C function.

    It returns a single scalar result and writes all other results via pointers.
    """
    inputs = [_parameter(value, "const ") for value in instance.inputs]
    results = (
        [] if instance.returns_scalar else [_result_parameter(value) for value in instance.outputs]
    )
    parameters = ", ".join([*["Model *m"] * instance.takes_model, *inputs, *results]) or "void"
    lines = [
        *_opening_lines(function, instance, local_values, body),
        *body,
        *_closing_lines(instance),
    ]
    return "\n".join(
        [
            (
                f"/* {function.name} "
                f"({function.where.file_and_line if function.where else 'no source'}) */"
            ),
            (
                "static "
                f"{C_TYPES[instance.outputs[0].type] if instance.returns_scalar else 'void'} "
                f"{instance.name}({parameters})"
            ),
            "{",
            *wrap_lines(lines),
            "}",
        ]
    )


def _opening_lines(
    function: Function, instance: FunctionInstance, local_values: list[CValue], body: list[str]
) -> list[str]:
    """Return the declarations, and `(void)` statements for unused variables."""
    lines = [
        _declaration(output)
        if instance.returns_scalar or not output.shape
        else f"memset({output.pointer}, 0, {output.size} * sizeof *{output.pointer});"
        for output in instance.outputs
    ]
    used = [
        (value, local.name)
        for value, local in zip(local_values, function.locals, strict=True)
        if uses_variable(_c_name(value), body)
    ]
    lines += [_declaration(value) for value, _ in used]
    read = {referenced_variable(reference) for reference in read_references(function.body)}
    unread = [value for value in instance.inputs if not uses_variable(_c_name(value), body)]
    unread += [value for value, name in used if name not in read]
    return lines + [f"(void){_c_name(value)};" for value in unread]


def _closing_lines(instance: FunctionInstance) -> list[str]:
    if instance.returns_scalar:
        return [f"return {instance.outputs[0].text.code};"]
    return [
        f"*{output.text.code}_result = {output.text.code};"
        for output in instance.outputs
        if not output.shape
    ]


def _result_parameter(value: CValue) -> str:
    return (
        _parameter(value, "") if value.shape else f"{C_TYPES[value.type]} *{value.text.code}_result"
    )


def _c_name(value: CValue) -> str:
    return value.pointer or value.text.code


def _parameter(value: CValue, qualifier: str) -> str:
    size = f"[{max(value.size, 1)}]" if value.shape else ""
    return f"{qualifier if value.shape else ''}{C_TYPES[value.type]} {_c_name(value)}{size}"


def _declaration(value: CValue) -> str:
    start = ' = ""' if value.type == "String" else " = 0"
    return (
        f"{C_TYPES[value.type]} "
        f"{_c_name(value)}{f'[{max(value.size, 1)}] = {{0}}' if value.shape else start};"
    )
