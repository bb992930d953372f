"""Build steps beyond pyproject.toml.

The optional extension modules and the bundle of shipped files.

The wheel carries scenarios, FMUs, plant and controller sources as cosim/_bundle/ in the layout of
the checkout, because scenarios name the others by relative paths. The package `plant_src` of the
wheel finds its modules there, so each file exists once.
"""

import os
import shutil
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_py import build_py

BUNDLED = ("controllers", "fmus", "plant_src", "scenarios")
PLANT_PACKAGE = '''"""Vehicles, world and sensors of cosim, in the bundle of its shipped files."""

from cosim.core import resources

__path__ = [str(resources.root() / "plant_src")]
'''


class BuildWithBundle(build_py):
    """The usual build of the package, and the bundle beside it.

    An editable install has no bundle, it uses the checkout.
    """

    def run(self) -> None:
        """Build the package, then copy the bundle into it."""
        if self.editable_mode:
            super().run()
            return
        self.packages = [name for name in self.packages if name.partition(".")[0] != "plant_src"]
        super().run()
        for name in BUNDLED:
            target = Path(self.build_lib) / "cosim" / "_bundle" / name
            shutil.copytree(
                name, target, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__")
            )
        plant = Path(self.build_lib) / "plant_src" / "__init__.py"
        plant.parent.mkdir(exist_ok=True)
        plant.write_text(PLANT_PACKAGE, encoding="utf-8")


def extension(name: str) -> Extension:
    """Extension that is optional unless COSIM_REQUIRE_NATIVE is set.

    Without it cosim runs slower, in pure Python.
    """
    optional = not os.environ.get("COSIM_REQUIRE_NATIVE")
    flags = [] if sys.platform == "win32" else ["-std=c11", "-O2", "-ffp-contract=off"]
    libraries = [] if sys.platform == "win32" else ["m"]
    source = f"{name.replace('.', '/')}.c"
    return Extension(
        name,
        [source],
        extra_compile_args=flags,
        libraries=libraries,
        py_limited_api=True,
        optional=optional,
    )


#: modules in C; the last one reads the state of a Linux process
EXTENSIONS = [
    "cosim.engine._native",
    "cosim.components.fmi._logger",
    "cosim.components.fmi.model_exchange._fixed_step",
    *(["cosim.process._process_state"] if sys.platform == "linux" else []),
]

setup(
    cmdclass={"build_py": BuildWithBundle},
    ext_modules=[extension(name) for name in EXTENSIONS],
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
