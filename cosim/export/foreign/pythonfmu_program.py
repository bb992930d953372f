"""Program that builds an FMU of a Python source with PythonFMU.

It runs in its own process, because it imports the source.

Arguments: the folder with all files, the name of the package that the folder becomes, the name of
the source in it, the folder for the FMU and for `units.json`, the attribute `units` of the class,
and the name of the class if it is not the only one.
"""

import json
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

from pythonfmu import Fmi2Slave
from pythonfmu.builder import FmuBuilder, get_model_class

#: entry of the FMU; it makes its folder a package (see `pythonfmu_export`)
_ENTRY = """\
\"\"\"Entry of the FMU, written by cosim: its folder as a package, and the class with a \
log of its exceptions.\"\"\"

import os

__path__, __package__ = [os.path.dirname(__file__)], __name__

from .slave_protection import load_class

{name} = load_class(globals(), "{source}", "{name}")
"""


def main(folder: Path, package: str, source: str, target: Path, class_name: str = "") -> None:
    """Write the entry module for the class, then the FMU.

    It is the named class, or the one that PythonFMU selects.
    """
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(folder))
    namespace = ModuleType(package)
    namespace.__path__ = [str(folder)]
    sys.modules[package] = namespace
    model_class = _select_class(f"{package}.{source}", class_name)
    del sys.modules[package]
    members = sorted(folder.iterdir())
    entry = folder / f"{package}.py"
    entry.write_text(_ENTRY.format(source=source, name=model_class.__name__))
    FmuBuilder.build_FMU(entry, target, members, canGetAndSetFMUstate=True)
    (target / "units.json").write_text(json.dumps(getattr(model_class, "units", {}), default=repr))


def _select_class(module: str, name: str) -> type:
    """Return the named subclass of `Fmi2Slave` of a module.

    Without a name the one that PythonFMU selects.

    Raises:
        ValueError: There is no such class, or PythonFMU cannot select one of several.
    """
    members = vars(import_module(module))
    classes = {
        key: each
        for key, each in sorted(members.items())
        if isinstance(each, type) and issubclass(each, Fmi2Slave)
    }
    classes.pop(Fmi2Slave.__name__, None)
    if name in classes:
        return classes[name]
    found = ", ".join(classes) or "none"
    if name:
        raise ValueError(f"no PythonFMU class is named {name}; found: {found}")
    try:
        selected: type = get_model_class(Path(f"{module}.py"))
    except ValueError:
        if len(classes) > 1:
            source = f"{module.rpartition('.')[2]}.py"
            text = (
                f"the file has several PythonFMU classes ({found}); write "
                f"{source}:{next(iter(classes))}"
            )
            raise ValueError(text) from None
        raise
    return selected


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], sys.argv[3], Path(sys.argv[4]), *sys.argv[5:])
