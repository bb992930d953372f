"""Export by OpenModelica, for models beyond our own emitter: the standard library, implicit equations, state events.

Written from OpenModelica's documentation and not tried with OpenModelica itself: the tests know the command, not its result.
The FMU contains OpenModelica's solver (Euler by default): compare its results with a reference before use.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from ....core.errors import InputError, Problem
from .rumoca_frontend import find_packages, model_name

_ERROR = re.compile(r"^(?:\[(?P<file>[^\]]+?):(?P<line>\d+):\d+-\d+:\d+:\w+\] )?Error: (?P<what>.+)$", re.MULTILINE)
_TIMEOUT = 1800.0


def export_with_omc(path: Path, target: Path, model: str | None = None) -> None:
    """Write the Modelica model `model` (default: named as the file) as an FMI 2.0 Co-Simulation FMU to `target`.

    Needs the OpenModelica compiler `omc` on PATH, and runs it in a temporary folder. The file may use the packages in folders
    beside it and the libraries that OpenModelica knows. Raises InputError without omc, and for everything that omc refuses.
    """
    compiler = shutil.which("omc")
    if compiler is None:
        raise InputError('OpenModelica is not installed: there is no "omc" on PATH (see https://openmodelica.org)')
    path = path.resolve()
    if not path.is_file():
        raise InputError(Problem("no such Modelica file", str(path)))
    with TemporaryDirectory() as folder:
        script = Path(folder) / "export.mos"
        script.write_text(_script(path, model), encoding="utf-8")
        log = _run_omc(compiler, script)
        made = next(Path(folder).glob("*.fmu"), None)
        if made is None:
            raise InputError(_parse_errors(log, path))
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(made, target)


def _script(path: Path, model: str | None) -> str:
    """What omc is to do: load the file, and what it may use, and build the FMU."""
    text = path.read_text(encoding="utf-8")
    packages = find_packages(path, text)
    own = [] if any(map(path.is_relative_to, packages)) else [path]  # a package loads its members
    files = [*(package / "package.mo" for package in packages), *own]
    loads = [f"loadFile({json.dumps(str(file), ensure_ascii=False)});" for file in files]
    build = f'buildModelFMU({model_name(path, text, model)}, version="2.0", fmuType="cs", platforms={{"static"}});'
    return "\n".join([*loads, build, "print(getErrorString());"]) + "\n"


def _run_omc(compiler: str, script: Path) -> str:
    """All that omc prints."""
    command = [compiler, script.name]
    try:
        done = subprocess.run(  # noqa: S603
            command,
            cwd=script.parent,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=_TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise InputError(f"OpenModelica was not ready after {_TIMEOUT:.0f} s") from None
    return done.stdout


def _parse_errors(log: str, path: Path) -> list[Problem]:
    """The errors in what omc printed, else all of it."""
    found = [Problem(e["what"], f"{e['file']}:{e['line']}" if e["file"] else str(path)) for e in _ERROR.finditer(log)]
    return found or [Problem(f"OpenModelica has made no FMU: {log.strip() or 'it printed nothing'}", str(path))]
