"""Instances of Model Exchange FMUs, integrated by the importer."""

from .versions import Fmi1Model, Fmi2Model, Fmi3Model

__all__ = ["Fmi1Model", "Fmi2Model", "Fmi3Model"]
