"""Fixtures that write scenario files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import cosim

BLOCKS = Path(__file__).parent / "pythonfmu_blocks.py"


class ScenarioFolder:
    """A temporary folder with scenario files."""

    def __init__(self, path: Path):
        self.path = path

    def write(self, content: dict[str, Any] | str, name: str = "scenario.json") -> Path:
        file = self.path / name
        file.write_text(content if isinstance(content, str) else json.dumps(content))
        return file

    @staticmethod
    def block(name: str, **more: Any) -> dict[str, Any]:
        return {"python": f"{BLOCKS}:{name}", **more}

    def scenario(
        self,
        components: dict[str, Any],
        connections: list[dict[str, Any]] | None = None,
        **more: Any,
    ) -> Path:
        content = {"name": "test", "stop_time": 3, "step_size": 1, "components": components}
        return self.write({**content, "connections": connections or [], **more})

    def problems_of(self, file: Path, **settings: Any) -> list[str]:
        """Return the problems for which a scenario file is refused, with paths relative to this
        folder.
        """
        with pytest.raises(cosim.InputError) as refusal:
            cosim.run(file, **settings)
        return [str(problem).replace(f"{self.path}/", "") for problem in refusal.value.problems]

    def problems(
        self,
        components: dict[str, Any],
        connections: list[dict[str, Any]] | None = None,
        **more: Any,
    ) -> list[str]:
        """Return the problems for which a scenario with these keys is refused."""
        return self.problems_of(self.scenario(components, connections, **more))


@pytest.fixture
def folder(tmp_path: Path) -> ScenarioFolder:
    return ScenarioFolder(tmp_path)
