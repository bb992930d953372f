"""Scenario files: reading, checking, and assembling them into systems."""

from .nested_systems import find_scenario, load_scenario
from .prepared_run import PreparedRun, prepare
from .schema import json_schema

__all__ = ["PreparedRun", "find_scenario", "json_schema", "load_scenario", "prepare"]
