"""pytest plugin that runs scenario files with checks or a reference as tests.

A scenario passes under the same conditions as in `cosim regress`. A scenario file with invalid JSON
fails with the location of the error. Results are written below `runs/` in pytest's root folder,
each in the folder of the same relative path. Tests may run in parallel under pytest-xdist.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from .studies.regression import EXPECTATION_KEYS, Regression, has_keys


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect a scenario file that has checks or a reference (hook of pytest)."""
    if (
        file_path.suffix == ".json"
        and _may_be_scenario(file_path)
        and has_keys(file_path, ("components",), EXPECTATION_KEYS)
    ):
        return ScenarioFile.from_parent(parent, path=file_path)
    return None


def _may_be_scenario(file: Path) -> bool:
    """Return whether a JSON file contains a key of scenarios.

    Other files, possibly with comments, must not be parsed.
    """
    try:
        return file.is_file() and any(
            key in file.read_bytes() for key in (b'"components"', b'"extends"')
        )
    except OSError:
        return False


class ScenarioFile(pytest.File):
    """Scenario file, which contains one test."""

    def collect(self) -> Iterator[ScenarioItem]:
        """Yield the test of the scenario."""
        yield ScenarioItem.from_parent(self, name=self.path.stem)


class ScenarioItem(pytest.Item):
    """Test that a scenario meets its checks and its reference."""

    def runtest(self) -> None:
        """Run the scenario; raise ScenarioError if it does not pass."""
        outcome = Regression(self.path, self._output_directory, update=False).run()
        if outcome.code:
            raise ScenarioError("\n".join([outcome.summary, *outcome.details]))

    @property
    def _output_directory(self) -> Path:
        """Separate output directory of the scenario.

        Names may repeat across folders, and tests may run in parallel.
        """
        root = self.config.rootpath
        relative = self.path.relative_to(
            root if self.path.is_relative_to(root) else self.path.anchor
        )
        return root / "runs" / relative.with_suffix("")

    def repr_failure(
        self, excinfo: pytest.ExceptionInfo[BaseException], *more: Any, **options: Any
    ) -> Any:
        """Return the failures of the scenario without a traceback."""
        return (
            str(excinfo.value)
            if isinstance(excinfo.value, ScenarioError)
            else super().repr_failure(excinfo, *more, **options)
        )

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Return the location of the test."""
        return self.path, None, self.name


class ScenarioError(Exception):
    """Failure of a scenario to meet its checks or its reference."""
