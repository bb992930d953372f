"""Binary values as text.

Two hexadecimal digits per byte, as in the `start` attribute of FMI 3.0 (section 2.4.7.5).
"""

from __future__ import annotations


def parse_binary(text: str) -> bytes:
    """Return the bytes of hexadecimal digits.

    Raises:
        ValueError: The text has another character or an odd number of digits.
    """
    try:
        return bytes.fromhex(text)
    except ValueError:
        raise ValueError(f"found {text[:80]!r}, expected two hexadecimal digits per byte") from None
