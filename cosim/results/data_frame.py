"""Results as pandas data frames (extra `dataframe`)."""

from __future__ import annotations

from typing import Any

from ..core.errors import InputError
from ..core.recording import Recording


def require_pandas() -> Any:
    """Return the package pandas; InputError if it is not installed."""
    try:
        import pandas as pd
    except ImportError:
        raise InputError(
            'data frames need the package pandas: pip install "fmi-cosim[dataframe]"'
        ) from None
    return pd


def to_dataframe(recording: Recording) -> Any:
    """Return a data frame with a column for each signal; the index is the time (s).

    The attribute `attrs["units"]` holds the unit of each signal.

    Raises:
        InputError: The package pandas is not installed.
    """
    pd = require_pandas()
    frame = pd.DataFrame(dict(recording.columns), index=pd.Index(recording.time, name="time"))
    frame.attrs["units"] = dict(recording.units)
    return frame
