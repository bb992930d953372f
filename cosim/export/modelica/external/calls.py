"""Generation of external_calls.c.

One C function for each external function of a model, which reports errors by its result.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from ..model.flat_model import Function, FunctionVariable
from ..model.syntax_tree import Builtin, Expression, ExternalCall, Literal, Name, raise_model_error

_C_TYPES = {
    "Real": "double",
    "Integer": "int32_t",
    "Enumeration": "int32_t",
    "Boolean": "bool",
    "String": "const char *",
    "ExternalObject": "void *",
}
_FIRST_HASH = "0xcbf29ce484222325"


class Argument(NamedTuple):
    """An argument of a C function."""

    type: str
    is_array: bool
    #: true for an output, which is passed by a pointer
    is_output: bool


@dataclass(frozen=True)
class CallSignature:
    """Signature of the C function for an external function.

    A constructor of an external object has the owner of the object as its first parameter, and the
    number of elements after each array. The result, if there is one, is written through the last
    parameter.
    """

    name: str
    function: str
    arguments: tuple[Argument, ...]
    #: type of the result, or "" without one
    result: str

    @property
    def is_constructor(self) -> bool:
        """True if the function returns an external object."""
        return self.result == "ExternalObject"


def external_call(function: Function) -> ExternalCall:
    """Return the call of the C function, which is the body of an external function."""
    (call,) = function.body
    assert isinstance(call, ExternalCall)
    return call


def call_signature(function: Function) -> CallSignature:
    """Return the signature of the C function that calls an external function.

    Raises:
        InputError: An argument has an unsupported type.
    """
    call = external_call(function)
    variables = {v.name: v for v in (*function.inputs, *function.outputs, *function.locals)}
    outputs = {v.name for v in function.outputs}
    arguments = tuple(_argument(a, variables, outputs, function) for a in call.arguments)
    result = variables[call.result.name].type if call.result else ""
    name = "call_" + re.sub(r"\W+", "_", function.name, flags=re.ASCII)
    return CallSignature(name, call.function, arguments, result)


def _argument(
    node: Expression, variables: dict[str, FunctionVariable], outputs: set[str], function: Function
) -> Argument:
    if isinstance(node, Name) and node.name in variables:
        variable = variables[node.name]
        if variable.dimensions and variable.type not in ("Real", "Integer", "Enumeration"):
            raise_model_error(
                f"{function.name}: arrays of type {variable.type} cannot be passed to a C function",
                variable.where,
            )
        return Argument(variable.type, bool(variable.dimensions), node.name in outputs)
    if isinstance(node, Literal):
        return Argument(node.type, False, False)
    if isinstance(node, Builtin) and node.name == "size":
        return Argument("Integer", False, False)
    return raise_model_error(
        f"{function.name}: an argument of a C function must be a variable, a literal or a size()",
        function.where,
    )


def declarations(functions: Iterable[Function]) -> str:
    """Return the text of external_calls.h."""
    heads = "\n".join(f"{_head(call_signature(function))};" for function in functions)
    return (
        "/* Calls of external functions; the result is false after an error. */\n#include "
        f'"external.h"\n\n{heads}\n'
    )


def definitions(functions: Iterable[Function]) -> str:
    """Return the text of external_calls.c."""
    functions = list(functions)
    includes = {
        f.external.include: f.where
        for f in reversed(functions)
        if f.external and f.external.include
    }
    lines = [
        f'#line {where.line} "{where.path.name}"\n{text}' if where else text
        for text, where in includes.items()
    ]
    texts = [_definition(function) for function in functions]
    return (
        "\n\n".join(['#include "external_calls.h"', *lines, '#line 1 "external_calls.c"', *texts])
        + "\n"
    )


def _head(signature: CallSignature) -> str:
    parameters = ["const void *owner"] * signature.is_constructor
    for k, argument in enumerate(signature.arguments):
        parameters.append(_parameter(argument, f"a{k}"))
        parameters += [f"size_t n{k}"] * (argument.is_array and signature.is_constructor)
    if signature.result:
        result_type = "uint64_t" if signature.is_constructor else _C_TYPES[signature.result]
        parameters.append(f"{result_type} *result")
    return f"bool {signature.name}({', '.join(parameters) or 'void'})"


def _parameter(argument: Argument, name: str) -> str:
    c_type = _C_TYPES[argument.type]
    if argument.is_output:
        return f"{c_type} *{name}"
    return f"const {c_type} *{name}" if argument.is_array else f"{c_type} {name}"


def _definition(function: Function) -> str:
    signature = call_signature(function)
    body = (
        _constructor_body(function, signature)
        if signature.is_constructor
        else _call_body(signature)
    )
    prototype = [] if function.external and function.external.include else [_prototype(signature)]
    return "\n".join([*prototype, _head(signature), "{", *(f"    {line}" for line in body), "}"])


def _call_body(signature: CallSignature) -> list[str]:
    arguments = signature.arguments
    booleans = [
        k
        for k, argument in enumerate(arguments)
        if argument.is_output and argument.type == "Boolean"
    ]
    call = _call(signature)
    lines = [
        f"if (a{k} == NULL) return false;"
        for k, argument in enumerate(arguments)
        if argument.type == "ExternalObject"
    ]
    lines += [f"int b{k} = 0;" for k in booleans]
    call = (
        f"*result = {call}{' != 0' * (signature.result == 'Boolean')}" if signature.result else call
    )
    copies = "".join(f"; *a{k} = b{k} != 0" for k in booleans)
    return [*lines, f"EXTERNAL_CALL({call}{copies});"]


def _constructor_body(function: Function, signature: CallSignature) -> list[str]:
    lines = [
        f"uint64_t hash = {_FIRST_HASH};",
        f'hash = external_hash_text(hash, "{function.name}");',
    ]
    for k, argument in enumerate(signature.arguments):
        if argument.type == "String":
            lines.append(f"hash = external_hash_text(hash, a{k});")
        else:
            bytes_ = f"a{k}, n{k} * sizeof *a{k}" if argument.is_array else f"&a{k}, sizeof a{k}"
            lines.append(f"hash = external_hash(hash, {bytes_});")
    destructor = function.external.destructor if function.external else ""
    return [
        *lines,
        "*result = external_next(owner, hash);",
        "if (external_object(owner, *result) != NULL) return true;",
        f"EXTERNAL_CALL(external_add(owner, *result, {_call(signature)}, {destructor or 'NULL'}));",
    ]


def _call(signature: CallSignature) -> str:
    def passed(k: int, argument: Argument) -> str:
        if argument.is_output and argument.type == "Boolean":
            return f"&b{k}"
        return (
            f"({_C_TYPES[argument.type]} *)a{k}"
            if argument.is_array and not argument.is_output
            else f"a{k}"
        )

    return f"{signature.function}({', '.join(passed(k, a) for k, a in enumerate(signature.arguments))})"


def _prototype(signature: CallSignature) -> str:
    """Return the declaration of a C function without an Include annotation."""
    types = {**_C_TYPES, "Boolean": "int"}
    parameters = (
        f"{types[a.type]}{' *' * (a.is_array or a.is_output)}" for a in signature.arguments
    )
    result = types[signature.result] if signature.result else "void"
    return f"extern {result} {signature.function}({', '.join(parameters) or 'void'});"
