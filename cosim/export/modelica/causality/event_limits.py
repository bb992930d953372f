"""Limits of the event iteration and of the events in a communication step, and the messages that name what exceeds them."""

from __future__ import annotations

from collections.abc import Sequence

from ..model.flat_model import Hybrid, Relation
from ..model.text import to_text

#: evaluations of the equations in an event, and events in a communication step
MAX_PASSES, MAX_EVENTS = 100, 100_000


def iterated_names(hybrid: Hybrid) -> Sequence[str]:
    """Return the variables that can require another evaluation in an event."""
    return list(
        dict.fromkeys((*hybrid.iterated, *(relation.name for relation in hybrid.relations)))
    )


def endless_reason(hybrid: Hybrid, name: str) -> str:
    """Return the message of an event iteration that does not end, because a variable changes in each evaluation."""
    condition = next(
        (to_text(relation.condition) for relation in hybrid.relations if relation.name == name),
        name,
    )
    return f"the event iteration does not end: {condition} changes in each evaluation"


def chattering_reason(relation: Relation) -> str:
    """Return the message of too many events in a communication step, the last one by this relation."""
    return (
        f"too many events in one step (chattering): {to_text(relation.condition)} changes again "
        "and again"
    )
