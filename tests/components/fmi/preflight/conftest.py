"""Valid FMUs from which the tests of this folder make invalid ones."""

from __future__ import annotations

from pathlib import Path

import pytest
from bad_fmus import read_members


@pytest.fixture(scope="session")
def good(probes: dict[int, Path]) -> dict[int, dict[str, bytes]]:
    """Contents of the members of the probe FMUs, by FMI major version."""
    return {version: read_members(path) for version, path in probes.items()}
