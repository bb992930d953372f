"""Values as JSON and as text.

Values that JSON does not have are written as others: bytes become {"bytes": hexadecimal digits},
NumPy values become lists and numbers.
"""

import json
import sys
from collections.abc import Mapping
from typing import Any

#: a JSON object that is only read
JsonObject = Mapping[str, Any]


def encode_value(value: Any) -> Any:
    """Return bytes or a NumPy value in JSON's types; the hook `default` of `json.dumps`."""
    return {"bytes": value.hex()} if isinstance(value, bytes) else value.tolist()


def decode_object(value: dict[str, Any]) -> Any:
    """Return the bytes that `encode_value` encoded, and any other object unchanged.

    The `object_hook` of `json.loads`.
    """
    return bytes.fromhex(value["bytes"]) if value.keys() == {"bytes"} else value


def parse_object(text: str | bytes) -> dict[str, Any]:
    """Return the JSON object in a text of a program that another one may have changed.

    Raises:
        ValueError: The text is not JSON, nested too deeply, or not an object.
    """
    try:
        value = json.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(value, dict):
        raise ValueError("expected an object")
    return value


def is_number(value: Any) -> bool:
    """Return whether a value is a Boolean, a float, or an integer in the range of a double."""
    return isinstance(value, float) or (isinstance(value, int) and abs(value) <= sys.float_info.max)


def parse_binary(text: str) -> bytes:
    """Return the bytes of hexadecimal digits.

    Raises:
        ValueError: The text has another character or an odd number of digits.
    """
    try:
        return bytes.fromhex(text)
    except ValueError:
        raise ValueError(f"found {text[:80]!r}, expected two hexadecimal digits per byte") from None
