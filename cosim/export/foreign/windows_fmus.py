"""FMUs for Windows on Linux: their DLLs run under Wine, in a process of their own.

A copy of the FMU in the user's cache gets a library for Linux, which forwards all calls
(wine/proxy.c), and a program for Windows, which receives them and calls the DLL (wine/worker.c).
The importer treats this copy like any other FMU.
"""

import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

from ...components.fmi import FmuFile
from ...components.fmi.preflight.archive import Archive, open_regular_file
from ...components.fmi.preflight.binary import WINDOWS, check_binary
from ...components.fmi.preflight.findings import raise_errors
from ...components.fmi.preflight.platforms import current_platform
from ...core.errors import InputError
from ...core.resources import cache_directory
from ...process.output_lock import LOCK_FILE, waiting_for_lock
from ..cache import cached_file
from ..fmu.compiler import compiler_version, find_compiler, ziglang_command
from ..fmu.package import write_archive

_SOURCES = Path(__file__).parent / "wine"
#: the second one is Debian's, whose program `wine` is a script that prints advice
_WINE_PROGRAMS = ("wine64", "/usr/lib/wine/wine64", "wine")
#: folder of the Windows binaries in the copy, below that of the Linux binary: only this one is
#: extracted
_WINDOWS_FOLDER = "windows"
_WORKER = "cosim_worker.exe"
_MINGW = "x86_64-w64-mingw32-gcc"
_PROXY_OPTIONS = ("-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-w", "-pthread")


def find_wine() -> str:
    """Return the path of Wine's program, or "" if this machine cannot run Windows FMUs."""
    if current_platform().platform_tuple != "x86_64-linux":
        return ""
    return next(filter(None, map(shutil.which, _WINE_PROGRAMS)), "")


def find_windows_compiler() -> list[str]:
    """Return the command of a C compiler for 64-bit Windows, of MinGW-w64 or of ziglang.

    Raises:
        InputError: There is none.
    """
    if shutil.which(_MINGW):
        return [_MINGW]
    if command := ziglang_command():
        return [*command, "-target", "x86_64-windows-gnu", "-fno-sanitize=all"]
    raise InputError(
        f"FMUs for Windows need a C compiler for Windows: the extra windows (ziglang) or {_MINGW}"
    )


def windows_fmu(file: FmuFile) -> Path:
    """Return a copy of an FMU with a library for this machine that runs its DLL under Wine.

    Args:
        file: The FMU, which has a DLL for 64-bit Windows.

    Raises:
        InputError: Wine or a compiler is missing, or the DLL does not export the functions that the
            importer calls.
    """
    wine = find_wine()
    if not wine:
        platforms = ", ".join(file.description.platforms)
        raise InputError(
            f'"{file.path}": has no binary for this machine; it has: {platforms}; Windows '
            "libraries need Wine (wine64)"
        )
    _check_library(file)
    prefix = _prepared_prefix(wine)
    worker, compiler = _built_worker(), find_compiler()
    parts = [
        file.sha256,
        wine,
        str(prefix),
        compiler,
        compiler_version(tuple(compiler)),
        sha256(worker.read_bytes()).hexdigest(),
    ]
    key = sha256(json.dumps([*parts, _sources_digest()]).encode()).hexdigest()[:24]
    return cached_file(
        key,
        file.path.name,
        lambda target: _write_copy(file, [wine, str(prefix)], worker, compiler, target),
    )


def _check_library(file: FmuFile) -> None:
    """Check the DLL without loading it."""
    model = file.examination.model
    assert model is not None  # the description has been built from it
    with open_regular_file(file.path) as content:
        findings = check_binary(Archive(content), model, file.description.interface, WINDOWS)
        raise_errors(file.path, list(findings))


def _sources_digest() -> str:
    return sha256(
        b"".join(
            path.read_bytes() for path in sorted(_SOURCES.iterdir()) if path.suffix in (".c", ".h")
        )
    ).hexdigest()


def _prepared_prefix(wine: str) -> Path:
    """Return the folder of Wine's registry and system files, which is created by the first use."""
    prefix = cache_directory() / "wine"
    if (prefix / "system.reg").is_file():
        return prefix
    prefix.mkdir(parents=True, exist_ok=True)
    with waiting_for_lock(prefix.parent / f"wine-{LOCK_FILE}"):
        if not (prefix / "system.reg").is_file():
            variables = {
                "WINEPREFIX": str(prefix),
                "WINEDEBUG": "-all",
                "WINEDLLOVERRIDES": "mscoree,mshtml,winemenubuilder.exe=",
            }
            _run(
                [wine, "wineboot", "--init"],
                "Wine cannot be initialized",
                {**os.environ, **variables},
            )
    return prefix


def _built_worker() -> Path:
    command = find_windows_compiler()
    key = sha256(
        json.dumps([_sources_digest(), command, compiler_version(tuple(command))]).encode()
    ).hexdigest()[:24]
    source = str(_SOURCES / "worker.c")
    text = "the program that runs Windows FMUs cannot be compiled"
    return cached_file(
        key, _WORKER, lambda target: _run([*command, "-O2", "-w", source, "-o", str(target)], text)
    )


def _write_copy(
    file: FmuFile, wine: Sequence[str], worker: Path, compiler: Sequence[str], target: Path
) -> None:
    members = file.read_members()
    major, identifier = file.description.major, file.description.model_identifier
    windows, own = (
        f"binaries/{WINDOWS.binary_folder(major)}/",
        current_platform().binary_folder(major),
    )
    texts = {
        "WINE": wine[0],
        "WINE_FOLDER": wine[1],
        "WORKER": f"{_WINDOWS_FOLDER}/{_WORKER}",
        "DLL": f"{_WINDOWS_FOLDER}/{identifier}{WINDOWS.suffix}",
    }
    prefix = f"{identifier}_fmi" if major == 1 else f"fmi{major}"
    definitions = [
        f"-DFMI={major}",
        f"-DPREFIX={prefix}",
        *(f"-D{name}={json.dumps(text)}" for name, text in texts.items()),
    ]
    library = target.with_suffix(".so")
    command = [
        *compiler,
        *_PROXY_OPTIONS,
        *definitions,
        str(_SOURCES / "proxy.c"),
        "-o",
        str(library),
        "-ldl",
    ]
    _run(command, f'the library that runs "{file.path}" under Wine cannot be compiled')
    moved = {
        f"binaries/{own}/{_WINDOWS_FOLDER}/{name.removeprefix(windows)}": name
        for name in members
        if name.startswith(windows)
    }
    members.update({new: members.pop(old) for new, old in moved.items()})
    members[f"binaries/{own}/{_WINDOWS_FOLDER}/{_WORKER}"] = worker.read_bytes()
    members[f"binaries/{own}/{identifier}.so"] = library.read_bytes()
    library.unlink()
    write_archive(members, target)


def _run(command: Sequence[str], failure: str, environment: dict[str, str] | None = None) -> None:
    process = subprocess.run(  # noqa: S603 - programs of the user
        command,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
        env=environment,
        stdin=subprocess.DEVNULL,
    )
    if process.returncode:
        lines = [
            line for line in process.stderr.splitlines() if "error" in line
        ] or process.stderr.splitlines()[-1:]
        raise InputError(f"{failure}: {lines[0] if lines else f'exit code {process.returncode}'}")
