"""FMUs as components; the only room that knows FMPy."""

from .description import DefaultExperiment, Description
from .file import FmuFile
from .instance import instantiate

__all__ = ["DefaultExperiment", "Description", "FmuFile", "instantiate"]
