"""Scenario files: reading, checking, and assembling them into systems."""

from .assembly import Assembly, assemble
from .schema import json_schema
from .tree import find, load

__all__ = ["Assembly", "assemble", "find", "json_schema", "load"]
