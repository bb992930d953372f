"""Program of the child process in which rumoca runs, since it may crash, hang or use up the memory.

It reads a request from standard input (JSON, see `main`) and writes lines of JSON: {"file": PATH}
before rumoca reads a file, and at last one of {"flat": TEXT}, {"syntax_errors": [[PATH, line,
message], ...]}, {"out_of_bounds": [[message, span], ...]}, {"error": text, "panicked": bool,
"lines": [first, last] or null} and {"version": text or null}, the version of rumoca if it is not
the requested one. The lines are those of the first part of the model to which the error is due;
they are null if the error has a place, or if there is no such part.
"""

import json
import re
import resource
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

#: the end of a message with file, line and column
_HAS_PLACE = re.compile(r"\[[^\[\]]+:\d+:\d+\]\s*$")
#: messages of a model whose names are resolved
_LATER_PHASE = re.compile(r"^\w+ failed: ")
_FUNCTION = re.compile(r"\bfunction\s+(\w+)")
_TOO_FEW_EQUATIONS = "(balance = -"
#: name of a model that reads the last element of each array
_LAST_ELEMENTS = "CosimLastElements"
_OUT_OF_BOUNDS = re.compile(
    r"(subscript \d+ for \S+ is out of bounds for dimension of size "
    r"\d+)[^\[]*\[[^\[\]]*:(\d+):\d+\]"
)


def main(request: dict[str, Any]) -> None:
    """Flatten a model.

    Args:
        request: "version" of rumoca; "files", the file of the model first; "packages", their
            folders; "model", its name; "text", the name under which a model outside a package is
            loaded and its text, null for one in a package; "declaration", text of the model if it
            is not in the file; "values", begin and end of the right side of each assignment and
            equation; "parts", those of each part of the text that can be removed; "trials", the
            largest number of each; "memory" (bytes), "output_size" (bytes) and "seconds" of
            processor time, the limits of this process.
    """
    limits = {
        resource.RLIMIT_DATA: "memory",
        resource.RLIMIT_FSIZE: "output_size",
        resource.RLIMIT_CPU: "seconds",
    }
    for kind, name in limits.items():
        resource.setrlimit(kind, (request[name], request[name]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    sys.modules["IPython"] = None  # type: ignore[assignment]  # rumoca would import it, which takes longer than a small model
    try:
        import rumoca
    except ImportError:
        _write({"version": None})
        return
    if rumoca.version() != request["version"]:
        _write({"version": rumoca.version()})
        return
    answer = _flatten(rumoca, request)
    # a file with a syntax error, and a package with such a file, cannot be loaded
    errors: list[tuple[str, int, str]] = []
    for file in request["files"] if "error" in answer else ():
        errors += _syntax_errors(rumoca, file)
    _write({"syntax_errors": errors} if errors else answer)


def _syntax_errors(rumoca: Any, file: str) -> list[tuple[str, int, str]]:
    _write({"file": file})
    try:
        text = Path(file).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        return [(file, 1, f"the file cannot be read: {error}")]
    diagnostics = rumoca.validate_source(text, filename=file)
    return [(file, each.line, each.message) for each in diagnostics if each.rule == "syntax-error"]


def _flatten(rumoca: Any, request: dict[str, Any]) -> dict[str, Any]:
    path, model, text, declaration = (
        request["files"][0],
        *(request[key] for key in ("model", "text", "declaration")),
    )
    _write({"file": path})
    session = rumoca.Session(roots=request["packages"])
    try:
        if text is None and declaration:
            compiled = session.loads(declaration, model=model, filename="<values>")
        elif text is None:
            compiled = session.load(path, model=model)
        # the text under a name without a folder, because rumoca reads all files beside an existing
        # file
        else:
            compiled = session.loads(f"{text[1]}\n{declaration}", model=model, filename=text[0])
        flat = compiled.to_json("flat")
        outside = _find_subscripts_out_of_bounds(session, request, flat)
        return {"out_of_bounds": outside} if outside else {"flat": flat}
    except BaseException as error:  # a panic of rumoca is not derived from Exception
        reason, panicked = str(error) or type(error).__name__, not isinstance(error, Exception)
    lines = None if panicked or text is None else _find_part(session, request, reason)
    return {"error": reason, "panicked": panicked, "lines": lines}


def _find_subscripts_out_of_bounds(
    session: Any, request: dict[str, Any], document: str
) -> list[tuple[str, Any]]:
    """Return message and span of each for-equation with a subscript beyond an array.

    rumoca enlarges such an array without a message. It refuses the same subscript outside a
    for-equation, so a further model with one declaration in each line reads the last element of
    each array.
    """
    try:
        flat = json.loads(document)
    except RecursionError:  # the parent process refuses this document
        return []
    loops = flat["structured_equations"]
    arrays = {
        name: node["dims"]
        for name, node in flat["variables"].items()
        if loops and node["dims"] and all(node["dims"])
    }
    if not arrays:
        return []
    name, text = request["text"] or ("<values>", "")
    begin = (
        f"{text}\n{request['declaration']}\nmodel {_LAST_ELEMENTS} extends {request['model']};\n"
    )
    lines = [
        f"Integer cosimSize{k} = size({{{array}{size}}}, 1);"
        for k, (array, size) in enumerate(arrays.items())
    ]
    try:
        session.loads(
            "\n".join([f"{begin}{lines[0]}", *lines[1:], f"end {_LAST_ELEMENTS};"]),
            model=_LAST_ELEMENTS,
            filename=name,
        )
    except BaseException as error:
        first, found = begin.count("\n") + 1, _OUT_OF_BOUNDS.findall(str(error))
        names = [(reason, list(arrays)[int(line) - first]) for reason, line in found]
        return [
            (reason, _find_loop(loops, array) or flat["variables"][array]["source_span"])
            for reason, array in names
        ]
    return []


def _find_loop(loops: list[dict[str, Any]], array: str) -> Any:
    """Return the span of the first for-equation that contains an array."""
    return next(
        (
            loop["span"]
            for loop in loops
            if f'"name": {json.dumps(array)}' in json.dumps(loop["template"])
        ),
        None,
    )


def _find_part(session: Any, request: dict[str, Any], reason: str) -> list[int] | None:
    """Return the first and last line of the first part of the model to which rumoca's error is due.

    It is the value with a constant in place of which there is no error, else the part without which
    there is another one or none.
    """
    text = request["text"][1]
    if _HAS_PLACE.search(reason):
        return None
    due = [
        each
        for each in request["values"][: request["trials"]]
        if _is_due(session, request, each, reason)
    ]
    functions = "|".join(_FUNCTION.findall(text))
    called = re.compile(rf"\b(?:{functions})\s*\(") if functions else None
    own = [
        (begin, end) for begin, end in due if not (called and called.search(text, begin, end))
    ]  # not in a function it calls
    for begin, end in own or due:
        return [text.count("\n", 0, position) + 1 for position in (begin, end)]
    for begin, end in request["parts"][: request["trials"]]:
        found = _outcome(session, request, begin, end, "")
        if found != reason and (
            found == "" or (_TOO_FEW_EQUATIONS not in reason and _LATER_PHASE.search(found))
        ):
            return [text.count("\n", 0, position) + 1 for position in (begin, end)]
    return None


def _is_due(session: Any, request: dict[str, Any], value: Sequence[int], reason: str) -> bool:
    """Return whether there is no error with 0 or false in place of a value."""
    begin, end = value
    found = _outcome(session, request, begin, end, "0")
    return found == "" or (
        found != reason and _outcome(session, request, begin, end, "false") == ""
    )


def _outcome(session: Any, request: dict[str, Any], begin: int, end: int, replacement: str) -> str:
    """Return the message for a text of which a part is replaced, "" without an error."""
    name, text = request["text"]
    blank = re.sub(r"[^\n]", " ", text[begin:end])
    changed = f"{text[:begin]}{replacement}{blank}{text[end:]}\n{request['declaration']}"
    try:
        session.loads(changed, model=request["model"], filename=name)
    except BaseException as error:
        return str(error)
    return ""


def _write(message: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(json.load(sys.stdin))
