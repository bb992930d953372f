"""Limits of the size of a system, far above real ones.

Larger systems are refused before they are expanded.
"""

import math

from .errors import InputError, Problem

#: components and nested systems of a scenario
MAX_COMPONENTS = 100_000
#: levels of nested systems
MAX_LEVELS = 100
#: connections of scalars
MAX_CONNECTIONS = 1_000_000
#: scalars of all components; an array counts with all its elements
MAX_SCALARS = 2_000_000
#: values that all delays together store (8 bytes each)
MAX_DELAYED_VALUES = 100_000_000
#: runs of a sweep or tuning, unless the caller permits more
MAX_RUNS = 100_000


def require_at_most(limit: int, count: int, noun: str, where: str = "", hint: str = "") -> None:
    """Check a count that was computed before anything is expanded.

    Args:
        limit: Largest accepted count.
        count: The count.
        noun: Plural of the counted things, for the message.
        where: Location in the file, for the message.
        hint: End of the message.

    Raises:
        InputError: The count exceeds the limit.
    """
    if count > limit:
        raise InputError(
            Problem(
                f"found {format_count(count)} {noun}, expected at most {format_count(limit)}{hint}",
                where,
            )
        )


def format_count(count: int) -> str:
    """Return a count with its digits in groups of three, or a power of ten if it is very large.

    >>> format_count(1234567), format_count(7**100)
    ('1 234 567', 'about 10^84')
    """
    if count >= 10**18:
        return f"about 10^{math.floor(math.log10(count))}"
    return f"{count:,}".replace(",", " ")
