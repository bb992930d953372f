"""Values that JSON does not have: bytes become {"bytes": hexadecimal digits}, NumPy values become lists and numbers."""

from __future__ import annotations

from typing import Any


def encode_value(value: Any) -> Any:
    """Return bytes or a NumPy value in JSON's types; the hook `default` of `json.dumps`."""
    return {"bytes": value.hex()} if isinstance(value, bytes) else value.tolist()


def decode_object(value: dict[str, Any]) -> Any:
    """Return the bytes that `encode_value` encoded, and any other object unchanged; the `object_hook` of `json.loads`."""
    return bytes.fromhex(value["bytes"]) if value.keys() == {"bytes"} else value
