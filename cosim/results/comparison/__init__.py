"""Is a run still the one that its reference records? Every signal has to stay in a tube around it."""

from .comparison import Comparison, Verdict, compare
from .tube import Tolerance, Tube

__all__ = ["Comparison", "Tolerance", "Tube", "Verdict", "compare"]
