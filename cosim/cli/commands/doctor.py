"""`cosim doctor`: report on packages, tools and sandboxes.

Each reported item is tested on this machine.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import TYPE_CHECKING, Any, Literal

import click

from ...core.errors import InputError
from ...core.resources import available_processors
from ..messages import print_json
from ..options import json_option

if TYPE_CHECKING:
    from packaging.requirements import Requirement

DISTRIBUTION = "fmi-cosim"


@dataclass(frozen=True)
class Finding:
    """Finding about one item.

    "missing" affects optional features, "broken" affects all commands.
    """

    section: str
    name: str
    found: str
    state: Literal["ok", "missing", "broken"] = "ok"


@click.command()
@json_option("a list of findings with section, name, found and state (ok, missing or broken)")
def command(as_json: bool) -> int:
    """Print which packages, tools and sandboxes are available on this machine.

    Exit code 0: all required parts work; 1: a required part is broken.
    """
    findings = [*_host_findings(), *_package_findings(), *_tool_findings(), *_sandbox_findings()]
    if as_json:
        print_json([asdict(finding) for finding in findings])
    else:
        _print_findings(findings)
    return 1 if any(finding.state == "broken" for finding in findings) else 0


def _print_findings(findings: Iterable[Finding]) -> None:
    section = ""
    for finding in findings:
        if finding.section != section:
            click.echo(f"{section and chr(10)}{finding.section}")
            section = finding.section
        mark = "" if finding.state == "ok" else f"{finding.state.upper()}: "
        click.echo(f"  {finding.name:20} {mark}{finding.found}")


def _host_findings() -> Iterator[Finding]:
    from ...core import __version__
    from ...core.resources import cache_directory, package_folder

    yield Finding("cosim", "cosim", f"{__version__} in {package_folder()}")
    yield Finding(
        "cosim", "Python", f"{platform.python_version()} ({platform.system()} {platform.machine()})"
    )
    yield Finding(
        "cosim", "processors", f"{available_processors()} of {os.cpu_count()} may be used"
    )
    yield _executor_finding()
    cache = cache_directory()
    existing = next(path for path in (cache, *cache.parents) if path.exists())
    writable = os.access(existing, os.W_OK)
    yield Finding(
        "cosim",
        "cache",
        f"{cache}{'' if writable else ' cannot be written'}",
        "ok" if writable else "missing",
    )


def _executor_finding() -> Finding:
    try:
        from ...engine import native_available
    except ImportError as error:
        return Finding("cosim", "executor", f"the engine cannot be imported: {error}", "broken")
    try:
        available = native_available()
    except InputError as error:
        return Finding("cosim", "executor", str(error), "broken")
    if available:
        return Finding("cosim", "executor", "native")
    return Finding("cosim", "executor", "Python only: the native one was not built", "missing")


def _package_findings() -> Iterator[Finding]:
    """Yield findings about the requirements of the installed distribution and about its extras."""
    from packaging.requirements import Requirement

    try:
        distribution = metadata.distribution(DISTRIBUTION)
    except metadata.PackageNotFoundError:
        yield Finding(
            "required packages",
            DISTRIBUTION,
            "not installed, so its requirements are unknown",
            "broken",
        )
        return
    requirements = [Requirement(text) for text in distribution.requires or ()]
    for requirement in requirements:
        if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
            version, fits = _installed_version(requirement)
            yield Finding(
                "required packages", requirement.name, version, "ok" if fits else "broken"
            )
    for extra in distribution.metadata.get_all("Provides-Extra") or ():
        yield _extra_finding(extra, requirements)


def _extra_finding(extra: str, requirements: Iterable[Requirement]) -> Finding:
    """Return the finding about an extra; other extras that it includes have their own findings."""
    own = [
        r
        for r in requirements
        if r.marker and r.marker.evaluate({"extra": extra}) and not r.marker.evaluate({"extra": ""})
    ]
    packages = [r for r in own if r.name != DISTRIBUTION]
    missing = [
        f"{r.name}: {_installed_version(r)[0]}" for r in packages if not _installed_version(r)[1]
    ]
    if missing:
        return Finding(
            "extras",
            extra,
            f"{'; '.join(missing)} (pip install '{DISTRIBUTION}[{extra}]')",
            "missing",
        )
    return Finding(
        "extras", extra, ", ".join(f"{r.name} {_installed_version(r)[0]}" for r in packages)
    )


def _installed_version(requirement: Requirement) -> tuple[str, bool]:
    """Return the installed version, and whether it satisfies the requirement."""
    try:
        version = metadata.version(requirement.name)
    except metadata.PackageNotFoundError:
        return "not installed", False
    if requirement.specifier.contains(version, prereleases=True):
        return version, True
    return f"{version}, required is {requirement.specifier}", False


def _tool_findings() -> Iterator[Finding]:
    from ...core.errors import InputError
    from ...export.fmu.compiler import compiler_version, find_compiler

    try:
        yield Finding("tools", "C compiler", compiler_version(tuple(find_compiler())))
    except (InputError, OSError) as error:
        yield Finding("tools", "C compiler", str(error), "missing")
    yield _windows_finding()
    yield from _library_findings()


def _windows_finding() -> Finding:
    """Return the finding about FMUs for Windows, which need Wine and a compiler for Windows."""
    from ...export.fmu.compiler import compiler_version
    from ...export.foreign.windows_fmus import find_windows_compiler, find_wine

    name, wine = "FMUs for Windows", find_wine()
    if not wine:
        return Finding(
            "tools", name, "no program wine64 or wine: 64-bit libraries cannot be used", "missing"
        )
    try:
        compiler = compiler_version(tuple(find_windows_compiler()))
    except (InputError, OSError) as error:
        return Finding("tools", name, str(error), "missing")
    version = _program_finding(name, wine, "--version").found
    return Finding("tools", name, f"{version} with {compiler}: 64-bit libraries only")


def _library_findings() -> Iterator[Finding]:
    """Yield the Modelica libraries of MODELICAPATH."""
    from ...export.modelica.frontend.libraries import libraries_in, library_folders

    title, folders = "Modelica libraries", library_folders([])
    if not folders:
        yield Finding("tools", title, "MODELICAPATH is not set", "missing")
    for folder in folders:
        try:
            found = ", ".join(map(str, libraries_in([folder])))
        except InputError as error:
            yield Finding("tools", title, f"MODELICAPATH: {error}", "missing")
        else:
            yield Finding(
                "tools", title, f"{folder}: {found or 'none'}", "ok" if found else "missing"
            )


def _program_finding(name: str, program: str, option: str) -> Finding:
    """Return the finding about a program, with the first line of its version text."""
    path = shutil.which(program)
    if path is None:
        return Finding("tools", name, f"no program {program}", "missing")
    try:
        done = subprocess.run([path, option], capture_output=True, text=True, check=True, timeout=5)  # noqa: S603
    except (OSError, subprocess.SubprocessError) as error:
        return Finding("tools", name, f"{path} does not work: {error}", "missing")
    return Finding("tools", name, done.stdout.partition("\n")[0].strip())


def _sandbox_findings() -> Iterator[Finding]:
    from ...process.sandbox import find_available_sandboxes, probe_restrictions

    available = find_available_sandboxes()
    if available.landlock:
        yield Finding("sandbox", "Landlock", f"version {available.landlock}: can confine files")
    else:
        yield Finding("sandbox", "Landlock", "not in this kernel (Linux 5.13 or newer)", "missing")
    if available.system_call_filter:
        yield Finding(
            "sandbox", "system call filter", "can close the network and all other processes"
        )
    else:
        yield Finding(
            "sandbox",
            "system call filter",
            "needs Linux with seccomp on x86_64 or aarch64",
            "missing",
        )
    if available.bubblewrap:
        yield Finding(
            "sandbox", "bubblewrap", f"{available.bubblewrap} works: --sandbox strict can be used"
        )
    else:
        yield Finding(
            "sandbox",
            "bubblewrap",
            "no working program bwrap; --sandbox strict cannot be used",
            "missing",
        )
    yield from (
        Finding("this process", name.replace("_", " "), _yes_or_no(value))
        for name, value in asdict(probe_restrictions()).items()
    )


def _yes_or_no(value: Any) -> str:
    return (
        {True: "yes", False: "no", None: "unlimited"}[value]
        if value is None or isinstance(value, bool)
        else str(value)
    )
