"""Scenario files: read, validate and build them into systems that are ready to run."""

from .nested_systems import find_scenario, load_scenario
from .prepared_run import IsolationMode, PreparedRun, import_figures, load
from .schema import json_schema

__all__ = ["IsolationMode", "PreparedRun", "find_scenario", "import_figures", "json_schema", "load", "load_scenario"]
