"""Vehicle files: one JSON file for each vehicle, whose name is that of the vehicle.

`README.md` describes them. They are found from this module, so that FMUs with the world contain
them: `cosim build` adds the JSON files beside imported modules.
"""

from __future__ import annotations

from pathlib import Path

#: file of each vehicle by name, sorted
VEHICLE_FILES = {file.stem: file for file in sorted(Path(__file__).parent.glob("*.json"))}
