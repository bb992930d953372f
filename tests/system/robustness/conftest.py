"""Fixtures of this room."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_folder import CommandFolder


@pytest.fixture
def workplace(tmp_path: Path) -> CommandFolder:
    return CommandFolder(tmp_path / "work")
