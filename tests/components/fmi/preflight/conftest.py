"""The good FMUs that everything here is made from."""

from __future__ import annotations

from pathlib import Path

import pytest
from bad_fmus import read_members


@pytest.fixture(scope="session")
def good(probes: dict[int, Path]) -> dict[int, dict[str, bytes]]:
    """Members of the hand-written FMUs, by FMI version."""
    return {version: read_members(path) for version, path in probes.items()}
