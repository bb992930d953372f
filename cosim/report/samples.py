"""A recorded run as the replay page takes it: 32-bit floats, thinned and packed."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..results import Result

#: rows of a run, and values of all its signals together, that a page can hold at ease
MOST_ROWS, MOST_VALUES = 5000, 1_000_000


def packed(result: Result) -> dict[str, Any]:
    """Time and all numeric signals of a run.

    `samples` is what `src/run.js` unpacks: float32 columns named by `columns`, of `rows` rows each; of each column the
    differences of its 32-bit words from row to row, of these first all lowest bytes, then all next; compressed by zlib, base64.
    Signals that never change stand in `constants`. Longer runs are thinned; extremes of signals are kept (see `thinned`).
    """
    numeric = {name: result[name] for name in result if result[name].dtype != object}
    constants = {name: _number(values[0]) for name, values in numeric.items() if _is_constant(values)}
    varying = {name: values for name, values in numeric.items() if name not in constants}
    most = max(2, min(MOST_ROWS, MOST_VALUES // (len(varying) + 1)))
    columns = {"time": sampled(result.time, most)} | {name: thinned(values, most) for name, values in varying.items()}
    return {
        "name": str(result.metadata.get("name", "run")),
        "rows": len(columns["time"]),
        "columns": list(columns),
        "constants": constants,
        "units": {name: result.units.get(name, "") for name in numeric},
        "samples": _pack(columns),
    }


def _is_constant(values: np.ndarray) -> bool:
    return bool(len(values) and np.isfinite(values[0]) and (values == values[0]).all())


def _number(value: Any) -> float:
    return float(np.float32(value))


def stride(rows: int, most: int) -> int:
    """Every how manieth of `rows` rows is kept so that there are about `most`."""
    return max(1, -(-rows // most))


def sampled(values: np.ndarray, most: int) -> np.ndarray:
    """Every n-th value, and the last."""
    step = stride(len(values), most)
    kept = values[::step]
    return kept if (len(values) - 1) % step == 0 else np.append(kept, values[-1:])


def thinned(values: np.ndarray, most: int) -> np.ndarray:
    """As `sampled`, but so that no peak is lost: of each two strides the smallest and the largest value, in their order.

    Where these stand for the values of a smooth curve they are at most two strides away from their own time.
    """
    step, values = stride(len(values), most), values.astype(np.float32)
    kept = sampled(values, most).copy()
    if step == 1:
        return kept
    pairs = len(values) // (2 * step)
    blocks = values[: pairs * 2 * step].reshape(pairs, 2 * step)
    lowest, highest = blocks.argmin(axis=1), blocks.argmax(axis=1)
    order = np.sort(np.stack([lowest, highest], axis=1), axis=1)
    rough = np.ptp(blocks, axis=1) > 4 * np.abs(blocks[:, -1] - blocks[:, 0])
    kept[: 2 * pairs].reshape(pairs, 2)[rough] = np.take_along_axis(blocks, order, axis=1)[rough]
    return kept


def _pack(columns: Mapping[str, np.ndarray]) -> str:
    table = np.stack([values.astype("<f4") for values in columns.values()])
    changes = np.diff(table.view("<i4"), axis=1, prepend=np.zeros((len(table), 1), "<i4"))
    planes = changes.astype("<i4").view(np.uint8).reshape(*table.shape, 4).transpose(0, 2, 1)
    return base64.b64encode(zlib.compress(planes.tobytes())).decode("ascii")
