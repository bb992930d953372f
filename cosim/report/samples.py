"""Compact form of a recorded run for the replay page: 32-bit floats, downsampled and compressed."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..results import Result

#: largest number of rows of a run, and of values of all its signals together, on a page
MAX_ROWS, MAX_VALUES = 5000, 1_000_000


def pack_run(result: Result) -> dict[str, Any]:
    """Return time and numeric signals of a run in the form that `page/src/run.js` unpacks.

    Signals that never change are in `constants`. Long runs are downsampled, but keep the extremes
    of signals. `samples` holds the float32 columns of the names `columns`, with `rows` rows each,
    encoded in these steps:

    1. differences of the 32-bit words from row to row
    2. for each column all lowest bytes, then all second bytes, and so on
    3. zlib, then base64
    """
    numeric = {name: result[name] for name in result if result[name].dtype != object}
    constants: dict[str, float] = {}
    varying: dict[str, np.ndarray] = {}
    for name, values in numeric.items():
        if is_constant(values):
            constants[name] = float(np.float32(values[0]))
        else:
            varying[name] = values
    max_rows = max(2, min(MAX_ROWS, MAX_VALUES // (len(varying) + 1)))
    columns = {"time": downsample(result.time, max_rows)}
    for name, values in varying.items():
        columns[name] = downsample_with_extremes(values, max_rows)
    return {
        "name": str(result.metadata.get("name", "run")),
        "rows": len(columns["time"]),
        "columns": list(columns),
        "constants": constants,
        "units": {name: result.units.get(name, "") for name in numeric},
        "samples": _encode_columns(columns),
    }


def is_constant(values: np.ndarray) -> bool:
    """Return True if all values are equal and finite."""
    return bool(len(values) and np.isfinite(values[0]) and (values == values[0]).all())


def _stride_blocks(values: np.ndarray, max_count: int) -> tuple[np.ndarray, int]:
    """Return the values in blocks, shape (blocks, 2 * stride), and the stride.

    The last block is padded with the last value.
    """
    stride = -(-len(values) // max_count)  # rounded up
    count = -(-len(values) // (2 * stride))
    padded = np.pad(values, (0, 2 * stride * count - len(values)), mode="edge")
    return padded.reshape(count, -1), stride


def downsample(values: np.ndarray, max_count: int) -> np.ndarray:
    """Return every n-th value and the last one, about `max_count` in all.

    Short arrays are returned as they are.
    """
    if len(values) <= max_count:
        return values
    blocks, stride = _stride_blocks(values, max_count)
    return np.append(blocks.ravel()[::stride], values[-1])


def downsample_with_extremes(values: np.ndarray, max_count: int) -> np.ndarray:
    """Downsample like `downsample`, but keep peaks.

    Where the values vary strongly within two strides, their minimum and maximum, in the order of
    time, replace the two samples.
    """
    values = values.astype(np.float32)
    samples = downsample(values, max_count)
    if len(values) <= max_count:
        return samples
    # A block spans two strides, so it has two samples: its first value and the one in its middle.
    # Its extremes move in time by less than a block, which a page cannot show. They replace the
    # samples only if the block varies more than the signal does from block to block: a slow signal
    # keeps its equidistant samples, and a short peak or noise keeps its height.
    blocks, _ = _stride_blocks(values, max_count)
    order = np.sort(np.stack([blocks.argmin(axis=1), blocks.argmax(axis=1)], axis=1), axis=1)
    change = np.abs(samples[2::2] - blocks[:, 0])  # from block to block
    has_peak = np.ptp(blocks, axis=1) > 4 * change
    samples[:-1].reshape(-1, 2)[has_peak] = np.take_along_axis(blocks, order, axis=1)[has_peak]
    return samples


def _encode_columns(columns: Mapping[str, np.ndarray]) -> str:
    # Neighbouring rows of a smooth signal differ in their low bits only. Differences of the words
    # are therefore small, and their high bytes, side by side, are runs of zeros that zlib packs.
    table = np.stack([values.astype("<f4") for values in columns.values()])
    changes = np.diff(table.view("<i4"), axis=1, prepend=np.zeros((len(table), 1), "<i4"))
    planes = changes.astype("<i4").view(np.uint8).reshape(*table.shape, 4).transpose(0, 2, 1)
    return base64.b64encode(zlib.compress(planes.tobytes())).decode("ascii")
