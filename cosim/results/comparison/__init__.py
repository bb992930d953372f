"""Comparison of a result with a reference.

Every signal has to stay in a tube around the reference.
"""

from .comparison import compare, needed_share
from .tube import Tolerance, Tube
from .verdict import Comparison, Verdict

__all__ = ["Comparison", "Tolerance", "Tube", "Verdict", "compare", "needed_share"]
