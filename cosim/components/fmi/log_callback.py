"""The logger callback of FMI 1.0 and FMI 2.0, whose message is a printf format followed by its arguments.

ctypes cannot read the arguments of a variadic function. Therefore a C function formats the messages of all instances and calls
one function of this module, which dispatches them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from itertools import count
from typing import Any

try:
    from . import _logger
except ImportError:  # installed without a C compiler: the text arrives unformatted
    _logger = None  # type: ignore[assignment]  # a module cannot be declared optional

#: receives the status and the text of a message
MessageHandler = Callable[[int, bytes | None], None]

_environments = count(1)
#: instance names and handlers by componentEnvironment, in the order of their registration
_handlers: dict[int, tuple[bytes, MessageHandler]] = {}


def register(callbacks: Any, instance_name: str, handler: MessageHandler) -> int:
    """Set the logger in the callback functions of an instance.

    Args:
        callbacks: FMPy's fmi1CallbackFunctions or fmi2CallbackFunctions.
        instance_name: Name of the instance, by which FMI 1.0 identifies it.
        handler: Function that receives the messages of the instance.

    Returns:
        The key of the registration, for `unregister`. It is the componentEnvironment of FMI 2.0.
    """
    key = next(_environments)
    _handlers[key] = instance_name.encode(), handler
    logger = ctypes.c_void_p(_logger.LOGGER) if _logger else _UNFORMATTED
    callbacks.logger = ctypes.cast(logger, type(callbacks.logger))
    if hasattr(callbacks, "componentEnvironment"):
        callbacks.componentEnvironment = key
    return key


def unregister(key: int) -> None:
    """Forget a registration; later messages of the instance go to another one, or are dropped."""
    _handlers.pop(key, None)


def _dispatch(environment: int | None, name: bytes | None, status: int, text: bytes | None) -> None:
    """Pass a message to the instance of the environment, or else of the name, or else to the newest one."""
    named = (handler for known, handler in reversed(_handlers.values()) if known == name)
    newest = (handler for _, handler in reversed(_handlers.values()))
    handler = (
        _handlers[environment][1]
        if environment in _handlers
        else next(named, None) or next(newest, None)
    )
    if handler:
        handler(status, text)


_receiver = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p)(
    _dispatch
)
_UNFORMATTED = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p
)(lambda environment, name, status, _, text: _dispatch(environment, name, status, text))
if _logger:
    ctypes.c_void_p.from_address(_logger.RECEIVER).value = ctypes.cast(
        _receiver, ctypes.c_void_p
    ).value
