"""A recorded run as the replay page takes it: 32-bit floats, thinned and packed."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..results import Result

#: rows of a run, and values of all its signals together, that a page can hold at ease
MAX_ROWS, MAX_VALUES = 5000, 1_000_000


def pack_run(result: Result) -> dict[str, Any]:
    """Time and all numeric signals of a run.

    `samples` is what `src/run.js` unpacks: float32 columns named by `columns`, of `rows` rows each; of each column the
    differences of its 32-bit words from row to row, of these first all lowest bytes, then all next; compressed by zlib, base64.
    Signals that never change stand in `constants`. Longer runs are thinned; extremes of signals are kept (see `thinned`).
    """
    numeric = {name: result[name] for name in result if result[name].dtype != object}
    constants = {name: _to_float32(values[0]) for name, values in numeric.items() if is_constant(values)}
    varying = {name: values for name, values in numeric.items() if name not in constants}
    most = max(2, min(MAX_ROWS, MAX_VALUES // (len(varying) + 1)))
    columns = {"time": downsample(result.time, most)} | {
        name: downsample_with_extremes(values, most) for name, values in varying.items()
    }
    return {
        "name": str(result.metadata.get("name", "run")),
        "rows": len(columns["time"]),
        "columns": list(columns),
        "constants": constants,
        "units": {name: result.units.get(name, "") for name in numeric},
        "samples": _encode_columns(columns),
    }


def is_constant(values: np.ndarray) -> bool:
    return bool(len(values) and np.isfinite(values[0]) and (values == values[0]).all())


def _to_float32(value: Any) -> float:
    return float(np.float32(value))


def _stride_blocks(values: np.ndarray, most: int) -> tuple[np.ndarray, int]:
    """Values in blocks of two strides, shape (blocks, 2 strides), the last one filled up with the last value; and the stride."""
    stride = -(-len(values) // most)
    count = -(-len(values) // (2 * stride))
    return np.pad(values, (0, 2 * stride * count - len(values)), mode="edge").reshape(count, -1), stride


def downsample(values: np.ndarray, max_count: int) -> np.ndarray:
    """All values if there are at most `most`; else every n-th, so that there are about as many, and the last."""
    if len(values) <= max_count:
        return values
    blocks, stride = _stride_blocks(values, max_count)
    return np.append(blocks.ravel()[::stride], values[-1])


def downsample_with_extremes(values: np.ndarray, max_count: int) -> np.ndarray:
    """As `sampled`, but so that no peak is lost: where there is one within two strides, the smallest and the largest value
    there, in their order, stand for the two values at their beginnings."""
    kept = downsample(values.astype(np.float32), max_count)
    if len(values) <= max_count:
        return kept
    blocks, _ = _stride_blocks(values.astype(np.float32), max_count)
    order = np.sort(np.stack([blocks.argmin(axis=1), blocks.argmax(axis=1)], axis=1), axis=1)
    change = np.abs(kept[2::2] - blocks[:, 0])  # from block to block
    rough = np.ptp(blocks, axis=1) > 4 * change
    kept[:-1].reshape(-1, 2)[rough] = np.take_along_axis(blocks, order, axis=1)[rough]
    return kept


def _encode_columns(columns: Mapping[str, np.ndarray]) -> str:
    table = np.stack([values.astype("<f4") for values in columns.values()])
    changes = np.diff(table.view("<i4"), axis=1, prepend=np.zeros((len(table), 1), "<i4"))
    planes = changes.astype("<i4").view(np.uint8).reshape(*table.shape, 4).transpose(0, 2, 1)
    return base64.b64encode(zlib.compress(planes.tobytes())).decode("ascii")
