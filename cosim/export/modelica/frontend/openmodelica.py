"""Export by OpenModelica, for features that the built-in compiler lacks.

Standard library, implicit equations, state events.

This module follows OpenModelica's documentation. It has not been tested with OpenModelica itself:
the tests check the command and not its result. The FMU contains OpenModelica's solver (Euler by
default): compare its results with a reference before use.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from ....core.errors import InputError, Problem
from ....results.files import write_file
from .rumoca_frontend import find_packages, model_name, read_source

_ERROR = re.compile(
    r"^(?:\[(?P<file>[^\]]+?):(?P<line>\d+):\d+-\d+:\d+:\w+\] )?Error: (?P<what>.+)$", re.MULTILINE
)
_TIMEOUT = 1800.0


def export_with_omc(path: Path, target: Path, model: str | None = None) -> None:
    """Export a Modelica model as an FMI 2.0 Co-Simulation FMU with the OpenModelica compiler `omc`, found on PATH.

    Args:
        path: The Modelica file. It may use the packages in folders beside it and OpenModelica's libraries.
        target: The FMU to write.
        model: Name of the model. None selects the model with the name of the file.

    Raises:
        InputError: The compiler is not installed, or it reports errors.
    """
    compiler = shutil.which("omc")
    if compiler is None:
        raise InputError(
            'OpenModelica is not installed: there is no "omc" on PATH (see https://openmodelica.org)'
        )
    path = path.resolve()
    with TemporaryDirectory() as folder:
        script = Path(folder) / "export.mos"
        script.write_text(_script(path, model), encoding="utf-8")
        log = _run_omc(compiler, script)
        fmu = next(Path(folder).glob("*.fmu"), None)
        if fmu is None:
            raise InputError(_parse_errors(log, path))
        write_file(target, fmu.read_bytes())


def _script(path: Path, model: str | None) -> str:
    """Return the script for omc: load the packages and the file, and build the FMU."""
    text = read_source(path)
    packages = find_packages(path, text)
    model_files = (
        [] if any(map(path.is_relative_to, packages)) else [path]
    )  # a package loads its members
    files = [*(package / "package.mo" for package in packages), *model_files]
    loads = [f"loadFile({json.dumps(str(file), ensure_ascii=False)});" for file in files]
    build = (
        f'buildModelFMU({model_name(path, text, model)}, version="2.0", fmuType="cs", '
        'platforms={"static"});'
    )
    return "\n".join([*loads, build, "print(getErrorString());"]) + "\n"


def _run_omc(compiler: str, script: Path) -> str:
    """Run omc and return its output."""
    command = [compiler, script.name]
    try:
        process = subprocess.run(  # noqa: S603
            command,
            cwd=script.parent,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=_TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise InputError(f"OpenModelica did not finish within {_TIMEOUT:.0f} s") from None
    return process.stdout


def _parse_errors(log: str, path: Path) -> list[Problem]:
    """Return the errors in the output of omc, or the whole output if it contains none."""
    problems = [
        Problem(e["what"], f"{e['file']}:{e['line']}" if e["file"] else str(path))
        for e in _ERROR.finditer(log)
    ]
    return problems or [
        Problem(
            f"OpenModelica has created no FMU: {log.strip() or 'it printed nothing'}", str(path)
        )
    ]
