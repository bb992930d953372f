"""Fixtures for all rooms."""

from foreign import probe, probes

__all__ = ["probe", "probes"]
