"""pytest runs scenarios: `pytest scenarios/` collects every scenario JSON that has checks or a reference as a test.

A scenario passes as under `cosim regress`; one that is no JSON fails too, and says where. Results go to runs/ in
pytest's root folder, each to the folder there that its file's path names. Works in parallel under pytest-xdist.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from .studies.regression import EXPECTATION_KEYS, Regression, has_keys


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """pytest's hook: asked for each file."""
    if file_path.suffix == ".json" and _may_be_scenario(file_path) and has_keys(file_path, ("components",), EXPECTATION_KEYS):
        return ScenarioFile.from_parent(parent, path=file_path)
    return None


def _may_be_scenario(file: Path) -> bool:
    """Whatever else ends with .json, with comments in it perhaps, is none of our business."""
    try:
        return file.is_file() and b'"components"' in file.read_bytes()
    except OSError:
        return False


class ScenarioFile(pytest.File):
    """A scenario's file: one test."""

    def collect(self) -> Iterator[ScenarioItem]:
        yield ScenarioItem.from_parent(self, name=self.path.stem)


class ScenarioItem(pytest.Item):
    """A scenario, held against its checks and its reference."""

    def runtest(self) -> None:
        outcome = Regression(self.path, self._output_directory, update=False).run()
        if outcome.code:
            raise ScenarioFailed("\n".join([outcome.summary, *outcome.details]))

    @property
    def _output_directory(self) -> Path:
        """Of its own for each scenario: those of several folders may have the same name, and run at the same time."""
        root = self.config.rootpath
        inside = self.path.relative_to(root if self.path.is_relative_to(root) else self.path.anchor)
        return root / "runs" / inside.with_suffix("")

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], *more: Any, **options: Any) -> Any:
        """What the scenario did not meet, without a traceback."""
        return (
            str(excinfo.value) if isinstance(excinfo.value, ScenarioFailed) else super().repr_failure(excinfo, *more, **options)
        )

    def reportinfo(self) -> tuple[Path, int | None, str]:
        return self.path, None, self.name


class ScenarioFailed(Exception):
    """A scenario did not do what it was expected to do."""
