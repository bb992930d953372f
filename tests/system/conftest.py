"""System tests have the marker `slow`: they start whole programs, hundreds of times, and often let
them fail.
"""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of this folder before pytest deselects tests by their markers."""
    for item in items:
        longer = any(item.get_closest_marker(name) for name in ("long", "fuzz", "benchmark"))
        if item.path.is_relative_to(Path(__file__).parent) and not longer:
            item.add_marker(pytest.mark.slow)
