"""The journal of a run whose memory foreign code has overwritten."""

import pytest

from cosim.process.journal import JOURNAL_SIZE, PHASE, Journal, Phase


@pytest.mark.parametrize("value", [-1, 6, 9187201950435737471])
def test_an_impossible_phase_is_not_that_of_a_run(value):
    """The supervisor reads the phase in a thread before it notices that the journal is not valid."""
    journal = Journal(bytearray(JOURNAL_SIZE))
    journal.enter_phase(Phase.STEPPING)
    assert journal.is_valid
    assert journal.in_loop
    journal[PHASE] = value
    assert not journal.is_valid
    assert not journal.in_loop
    with pytest.raises(ValueError, match="not a valid Phase"):
        journal.phase  # noqa: B018
    with journal.updating_csv() as possible:
        assert not possible
