"""Fixtures for all rooms."""

import pytest
from foreign import probe, probes

from cosim.engine import EXECUTORS
from cosim.engine import available as native_available

__all__ = ["executor", "probe", "probes"]


@pytest.fixture(params=sorted(EXECUTORS))
def executor(request, monkeypatch):
    """Whatever a test simulates, it does so with each executor."""
    if request.param == "native" and not native_available():
        pytest.skip("the native executor was not built")
    monkeypatch.setattr("cosim.simulate.executor_kind", lambda kind: EXECUTORS[request.param])
    return request.param
