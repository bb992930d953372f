"""Export of sources that implement FMI themselves, and binaries for FMUs that lack one."""

from pathlib import Path

from ...components.fmi import FmuFile
from ...core.errors import InputError


def add_binary(file: FmuFile) -> Path | None:
    """Write a copy of an FMU with a binary for this machine into the user's cache.

    The binary is compiled from the sources of the FMU, or else runs its library for Windows under
    Wine.

    Args:
        file: An FMU without a binary for this machine.

    Returns:
        The copy; None if the FMU has neither sources nor a library for Windows.

    Raises:
        InputError: The sources cannot be compiled, or the library for Windows cannot be used.
    """
    from .source_fmus import compiled_fmu
    from .windows_fmus import find_wine, windows_fmu

    if file.must_be_compiled:
        try:
            return compiled_fmu(file)
        except InputError:
            if not file.has_windows_binary or not find_wine():
                raise
    return windows_fmu(file) if file.has_windows_binary else None
