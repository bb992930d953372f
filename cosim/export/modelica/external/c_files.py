"""C files of external functions: those that they include, and the generated calls.

The generated file external_calls.c has one C function for each external function of a model, which
reports errors by its result.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from itertools import product
from pathlib import Path
from typing import NamedTuple

from ..model.flat_model import Function, FunctionVariable
from ..model.syntax_tree import Expression, ExternalCall, Literal, Name, raise_model_error
from ..model.traversal import is_call

_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', re.MULTILINE)
_URI = re.compile(r"modelica://(\w+)/?(.*)")
_DEFAULT_FOLDERS = (
    "Resources/Include",
    "Resources/C-Sources",
    "Resources/Source",
    "Resources/Library",
)
_RUNTIME = ("external.c", "external.h", "ModelicaUtilities.h")

#: first lines of each C file: the Standard Library has neither files nor user tables, and its time
#: is 0 (no random results)
_OPTIONS = (
    "#define NO_FILE_SYSTEM\n#define NO_TIME\n#define NO_PID\n#define DUMMY_FUNCTION_USERTAB\n"
    "#line 1\n"
)

#: C file of the Standard Library that another one needs without including its header
_COMPANIONS = {"ModelicaStandardTables": "ModelicaStandardTablesUsertab.c"}

#: folders of the C files of a library, beside the folder of its headers
_SOURCE_FOLDERS = (".", "../C-Sources", "../Source")

#: folders of the static libraries of a library, in its LibraryDirectory or beside the folder of its
#: headers
_LIBRARY_FOLDERS = ("linux64", ".", "../Library/linux64", "../Library")


def external_files(functions: Iterable[Function], packages: Mapping[str, Path]) -> dict[str, str]:
    """Return the C files of the external functions of a model.

    Args:
        functions: The external functions.
        packages: Top-level package -> its folder.

    Returns:
        File name -> text; empty without external functions.

    Raises:
        InputError: A file or a library is not found.
    """
    functions = sorted(functions, key=lambda f: f.name)
    if not functions:
        return {}
    folder = resources.files(__package__ or "")
    files = {name: folder.joinpath(name).read_text(encoding="utf-8") for name in _RUNTIME}
    for function in functions:
        _add_files(function, packages, files)
    return files | {
        "external_calls.h": declarations(functions),
        "external_calls.c": definitions(functions),
    }


def external_archives(
    functions: Iterable[Function], packages: Mapping[str, Path]
) -> dict[str, Path]:
    """Return the static libraries (file name -> file) of Library annotations."""
    found: dict[str, Path] = {}
    for function in sorted(functions, key=lambda f: f.name):
        assert function.external
        for library in function.external.libraries:
            name = f"lib{library}.a"
            places = product(_folders(function, packages), _LIBRARY_FOLDERS)
            if path := _first_file(folder / sub / name for folder, sub in places):
                found[name] = path
    return found


def _first_file(candidates: Iterable[Path]) -> Path | None:
    return next((path for path in candidates if path.is_file()), None)


def _add_files(function: Function, packages: Mapping[str, Path], files: dict[str, str]) -> None:
    assert function.external
    folders = _folders(function, packages)
    pending = _INCLUDE.findall(function.external.include)
    required = set(pending)
    pending += map("".join, product(function.external.libraries, (".h", ".c")))
    while pending:
        name = pending.pop()
        if Path(name).name in files:
            continue
        path = _first_file(folder / name for folder in folders)
        if path is None:
            if name in required:
                places = ", ".join(map(str, folders)) or "no folder"
                raise_model_error(
                    f'{function.name}: the file "{name}" of its Include annotation is not '
                    f"found in {places}",
                    function.where,
                )
            continue
        for source in (path, *_implementations(path)):
            text = source.read_text(encoding="utf-8", errors="replace")
            files[source.name] = f"{_OPTIONS}{text}" if source.suffix == ".c" else text
            pending += _INCLUDE.findall(files[source.name])
    _check_libraries(function, packages, files)


def _check_libraries(
    function: Function, packages: Mapping[str, Path], files: Mapping[str, str]
) -> None:
    """Raise InputError if no file of a function's libraries is found.

    A function with an Include annotation needs none.
    """
    assert function.external
    libraries = function.external.libraries
    c_files = map("".join, product(libraries, (".c", ".h")))
    if function.external.include or not libraries or not files.keys().isdisjoint(c_files):
        return
    if not external_archives([function], packages):
        names = ", ".join(f"{name}.c, lib{name}.a" for name in libraries)
        places = ", ".join(map(str, _folders(function, packages)))
        raise_model_error(
            f"{function.name}: no file of its Library annotation ({names}) is found in {places}",
            function.where,
        )


def _implementations(header: Path) -> list[Path]:
    """Return the C file of a header, if there is one, and its companion."""
    names = [
        f"{header.stem}.c",
        *([_COMPANIONS[header.stem]] if header.stem in _COMPANIONS else []),
    ]
    candidates = (header.parent / folder / name for name, folder in product(names, _SOURCE_FOLDERS))
    return [path for path in candidates if header.suffix == ".h" and path.is_file()]


def _folders(function: Function, packages: Mapping[str, Path]) -> Sequence[Path]:
    """Return the folders of the C files of an external function.

    Those of its annotations, else those of its file's package.
    """
    assert function.external
    own = function.where.path.parent if function.where else Path()
    given = [
        text
        for text in (function.external.include_directory, function.external.library_directory)
        if text
    ]
    annotated = []
    for text in given:
        uri = _URI.match(text)
        if uri and uri[1] not in packages:
            raise_model_error(f'{function.name}: unknown package in "{text}"', function.where)
        annotated.append(packages[uri[1]] / uri[2] if uri else own / text)
    if annotated:
        return annotated
    defaults = (parent / name for parent, name in product((own, *own.parents), _DEFAULT_FOLDERS))
    return [own, *(folder for folder in defaults if folder.is_dir())]


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
    if is_call(node, "size"):
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

    arguments = ", ".join(passed(k, a) for k, a in enumerate(signature.arguments))
    return f"{signature.function}({arguments})"


def _prototype(signature: CallSignature) -> str:
    """Return the declaration of a C function without an Include annotation."""
    types = {**_C_TYPES, "Boolean": "int"}
    parameters = (
        f"{types[a.type]}{' *' * (a.is_array or a.is_output)}" for a in signature.arguments
    )
    result = types[signature.result] if signature.result else "void"
    return f"extern {result} {signature.function}({', '.join(parameters) or 'void'});"
