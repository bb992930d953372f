"""The journal of a run whose memory foreign code has overwritten."""

import pytest

from cosim.process.journal import (
    JOURNAL_SIZE,
    PHASE,
    Journal,
    Phase,
    calling_component,
    calling_several_components,
    set_current_journal,
)


@pytest.mark.parametrize("value", [-1, 6, 9187201950435737471])
def test_an_impossible_phase_is_not_that_of_a_run(value):
    journal = Journal(bytearray(JOURNAL_SIZE))
    journal.enter_phase(Phase.STEPPING)
    assert journal.is_valid
    journal[PHASE] = value
    assert not journal.is_valid
    with pytest.raises(ValueError, match="not a valid Phase"):
        journal.phase  # noqa: B018


def test_calls_on_threads_are_not_recorded_one_by_one():
    """Otherwise a crash on one thread would be attributed to the component that another thread has
    called last.
    """
    journal = Journal(bytearray(JOURNAL_SIZE))
    set_current_journal(journal)
    try:
        journal.record_call("one of a, b", "parallel step", 0.5)
        with calling_several_components(), calling_component("a", "fmi2GetString", "step"):
            assert journal.activity().component == "one of a, b"
        with calling_component("a", "fmi2GetString", "step"):
            assert journal.activity().component == "a"
    finally:
        set_current_journal(None)
