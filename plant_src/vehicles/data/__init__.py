"""Vehicle files: one JSON file for each vehicle, whose name is that of the vehicle.

`../README.md` describes them.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any


def read_vehicle_files() -> Iterator[tuple[str, Any]]:
    """Yield name and data of each vehicle, sorted by name."""
    for file in sorted(Path(__file__).parent.glob("*.json")):
        yield file.stem, json.loads(file.read_text(encoding="utf-8"))
