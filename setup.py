"""Puts scenarios, FMUs, plant and controller sources into the wheel, as cosim/_bundle/ in the layout of the checkout."""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

BUNDLED = ("controllers", "fmus", "plant_src", "scenarios")


class BuildWithBundle(build_py):
    """The usual build of the package, and the bundle beside it (not in an editable install, which uses the checkout)."""

    def run(self) -> None:
        super().run()
        if self.editable_mode:
            return
        for name in BUNDLED:
            target = Path(self.build_lib) / "cosim" / "_bundle" / name
            shutil.copytree(name, target, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))


setup(cmdclass={"build_py": BuildWithBundle})
