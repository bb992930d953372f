"""Recorded runs of a report page, unpacked by independent code."""

import base64
import zlib

import numpy as np


def unpacked(packed):
    """Columns by name: the four bytes of each word put together, and the words summed up."""
    raw = zlib.decompress(base64.b64decode(packed["samples"]))
    rows, columns = packed["rows"], {}
    for i, name in enumerate(packed["columns"]):
        planes = [raw[4 * rows * i + rows * k : 4 * rows * i + rows * (k + 1)] for k in range(4)]
        words, total = [], 0
        for quadruple in zip(*planes, strict=True):
            total = (total + int.from_bytes(bytes(quadruple), "little")) % 2**32
            words.append(total)
        columns[name] = np.array(words, np.uint32).view(np.float32)
    return columns
