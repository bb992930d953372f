"""Program that builds an FMU of a Python source with PythonFMU; it runs in its own process, because it imports the source.

Arguments: the folder with all files, the name of the package that the folder becomes, the name of the source in it, and the
folder for the FMU and for `units.json`, the attribute `units` of the class.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import ModuleType

from pythonfmu.builder import FmuBuilder, get_model_class

#: entry of the FMU; it makes its folder a package (see `python_class`)
_ENTRY = """\
\"\"\"Entry of the FMU, written by cosim: its folder as a package, and the class with a log of its exceptions.\"\"\"

import os

__path__, __package__ = [os.path.dirname(__file__)], __name__

from .slave_protection import load_class

{name} = load_class(globals(), "{source}", "{name}")
"""


def main(folder: Path, package: str, source: str, target: Path) -> None:
    """Write the entry module for the class that PythonFMU selects, then the FMU."""
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(folder))
    namespace = ModuleType(package)
    namespace.__path__ = [str(folder)]
    sys.modules[package] = namespace
    model_class = get_model_class(Path(f"{package}.{source}.py"))
    del sys.modules[package]
    members = sorted(folder.iterdir())
    entry = folder / f"{package}.py"
    entry.write_text(_ENTRY.format(source=source, name=model_class.__name__))
    FmuBuilder.build_FMU(entry, target, members, canGetAndSetFMUstate=True)
    (target / "units.json").write_text(json.dumps(getattr(model_class, "units", {}), default=repr))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], sys.argv[3], Path(sys.argv[4]))
