"""pytest runs scenarios: `pytest scenarios/` collects every scenario JSON that has checks or a reference as a test.

A scenario passes as under `cosim regress`; results go to runs/ in pytest's root folder. Works in parallel under pytest-xdist.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """pytest's hook: asked for each file."""
    if file_path.suffix == ".json" and _is_test(file_path):
        return ScenarioFile.from_parent(parent, path=file_path)
    return None


def _is_test(path: Path) -> bool:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    scenario = isinstance(content, dict) and {"components", "stop_time"} <= content.keys()
    return scenario and bool(content.get("checks") or content.get("reference"))


class ScenarioFile(pytest.File):
    """A scenario's file: one test."""

    def collect(self) -> Iterator[Scenario]:
        yield Scenario.from_parent(self, name=self.path.stem)


class Scenario(pytest.Item):
    """A scenario, held against its checks and its reference."""

    def runtest(self) -> None:
        from .cli.regression import Regression

        outcome = Regression(self.path, self.config.rootpath / "runs" / self.name, update=False).outcome()
        if outcome.code:
            raise Unmet("\n".join([outcome.summary, *outcome.details]))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], *more: Any, **options: Any) -> Any:
        """What the scenario did not meet, without a traceback."""
        return str(excinfo.value) if isinstance(excinfo.value, Unmet) else super().repr_failure(excinfo, *more, **options)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        return self.path, None, self.name


class Unmet(Exception):
    """A scenario did not do what it was expected to do."""
