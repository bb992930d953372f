"""`cosim doctor`: report on packages, tools and sandboxes.

Each reported item is tested on this machine.
"""

from __future__ import annotations

import os
import platform
import subprocess
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import TYPE_CHECKING, Literal

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
        section = ""
        for finding in findings:
            if finding.section != section:
                click.echo(f"{section and chr(10)}{finding.section}")
                section = finding.section
            mark = "" if finding.state == "ok" else f"{finding.state.upper()}: "
            click.echo(f"  {finding.name:20} {mark}{finding.found}")
    return 1 if any(finding.state == "broken" for finding in findings) else 0


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
    yield _either("cosim", "cache", str(cache) if writable else "", f"{cache} cannot be written")


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
    versions, missing = [], []
    for each in requirements:
        marker = each.marker
        is_own = marker and marker.evaluate({"extra": extra}) and not marker.evaluate({"extra": ""})
        if is_own and each.name != DISTRIBUTION:
            version, fits = _installed_version(each)
            versions.append(f"{each.name} {version}")
            if not fits:
                missing.append(f"{each.name}: {version}")
    if missing:
        text = f"{'; '.join(missing)} (pip install '{DISTRIBUTION}[{extra}]')"
        return Finding("extras", extra, text, "missing")
    return Finding("extras", extra, ", ".join(versions))


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
    from ...export.fmu.compiler import compiler_version, find_compiler
    from ...export.foreign.windows_fmus import find_windows_compiler, find_wine
    from ...export.modelica.frontend.libraries import libraries_in, library_folders

    yield _tried("C compiler", lambda: compiler_version(tuple(find_compiler())))
    name, wine = "FMUs for Windows", find_wine()
    if wine:
        compiler = _tried(name, lambda: compiler_version(tuple(find_windows_compiler())))
        text = f"{_program_version(wine)} with {compiler.found}: 64-bit libraries only"
        yield compiler if compiler.state == "missing" else Finding("tools", name, text)
    else:
        text = "no program wine64 or wine: 64-bit libraries cannot be used"
        yield Finding("tools", name, text, "missing")
    name, folders = "Modelica libraries", library_folders([])
    if not folders:
        yield Finding("tools", name, "MODELICAPATH is not set", "missing")
    for folder in folders:
        try:
            found = ", ".join(map(str, libraries_in([folder])))
        except InputError as error:
            yield Finding("tools", name, f"MODELICAPATH: {error}", "missing")
        else:
            yield _either("tools", name, found and f"{folder}: {found}", f"{folder}: none")


def _either(section: str, name: str, found: str, missing: str) -> Finding:
    """Return a finding that is missing if `found` is ""."""
    return Finding(section, name, found or missing, "ok" if found else "missing")


def _tried(name: str, find: Callable[[], str]) -> Finding:
    """Return the finding about a tool, which is missing if `find` raises an error."""
    try:
        return Finding("tools", name, find())
    except (InputError, OSError) as error:
        return Finding("tools", name, str(error), "missing")


def _program_version(path: str) -> str:
    """Return the first line of the version text of a program."""
    try:
        done = subprocess.run(  # noqa: S603
            [path, "--version"], capture_output=True, text=True, check=True, timeout=5
        )
    except (OSError, subprocess.SubprocessError) as error:
        return f"{path} does not work: {error}"
    return done.stdout.partition("\n")[0].strip()


def _sandbox_findings() -> Iterator[Finding]:
    from ...process.sandbox import find_available_sandboxes, probe_restrictions

    available = find_available_sandboxes()
    yield _either(
        "sandbox",
        "Landlock",
        f"version {available.landlock}: can confine files" if available.landlock else "",
        "not in this kernel (Linux 5.13 or newer)",
    )
    has_filter = available.system_call_filter
    yield _either(
        "sandbox",
        "system call filter",
        "can close the network and all other processes" if has_filter else "",
        "needs Linux with seccomp on x86_64 or aarch64",
    )
    program = available.bubblewrap
    yield _either(
        "sandbox",
        "bubblewrap",
        f"{program} works: --sandbox strict can be used" if program else "",
        "no working program bwrap; --sandbox strict cannot be used",
    )
    words = {True: "yes", False: "no", None: "unlimited"}
    for name, value in asdict(probe_restrictions()).items():
        is_word = value is None or isinstance(value, bool)
        text = words[value] if is_word else str(value)
        yield Finding("this process", name.replace("_", " "), text)
