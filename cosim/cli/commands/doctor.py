"""`cosim doctor`: what is installed and active here; it says nothing that it did not look up or try."""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import TYPE_CHECKING, Any, Literal

import click

from ...core.processors import available_processors

if TYPE_CHECKING:
    from packaging.requirements import Requirement

DISTRIBUTION = "fmi-cosim"


@dataclass(frozen=True)
class Finding:
    """One thing: where it belongs, its name and what was found; "missing" hurts only who needs it, "broken" everybody."""

    section: str
    name: str
    found: str
    state: Literal["ok", "missing", "broken"] = "ok"


@click.command()
@click.option("--json", "as_json", is_flag=True, help="A JSON list of findings instead of text.")
def command(as_json: bool) -> int:
    """Print what is installed, what can be used and what holds for this process.

    Exit code 0, or 1 when something that is required is broken.
    """
    findings = [*_host_findings(), *_package_findings(), *_tool_findings(), *_sandbox_findings()]
    if as_json:
        click.echo(json.dumps([asdict(finding) for finding in findings], indent=2))
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
    from ...core.resources import cache_directory, package_folder
    from ...core.version import __version__

    yield Finding("cosim", "cosim", f"{__version__} in {package_folder()}")
    yield Finding("cosim", "Python", f"{platform.python_version()} ({platform.system()} {platform.machine()})")
    yield Finding("cosim", "processors", f"{available_processors()} of {os.cpu_count()} may be used")
    yield _executor_finding()
    cache = cache_directory()
    there = next(path for path in (cache, *cache.parents) if path.exists())
    usable = os.access(there, os.W_OK)
    yield Finding("cosim", "cache", f"{cache}{'' if usable else ' cannot be written'}", "ok" if usable else "missing")


def _executor_finding() -> Finding:
    try:
        from ...engine import native_available
    except ImportError as error:
        return Finding("cosim", "executor", f"the engine cannot be imported: {error}", "broken")
    if native_available():
        return Finding("cosim", "executor", "native")
    return Finding("cosim", "executor", "Python only: the native one was not built", "missing")


def _package_findings() -> Iterator[Finding]:
    """Requirements as the installed distribution states them, and which extras are complete."""
    from packaging.requirements import Requirement

    try:
        own = metadata.distribution(DISTRIBUTION)
    except metadata.PackageNotFoundError:
        yield Finding("required packages", DISTRIBUTION, "not installed, so its requirements are unknown", "broken")
        return
    requirements = [Requirement(text) for text in own.requires or ()]
    for requirement in requirements:
        if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
            found, fits = _installed_version(requirement)
            yield Finding("required packages", requirement.name, found, "ok" if fits else "broken")
    for extra in own.metadata.get_all("Provides-Extra") or ():
        yield _extra_finding(extra, requirements)


def _extra_finding(extra: str, requirements: Iterable[Requirement]) -> Finding:
    """Other extras that this one names are listed on their own."""
    only = [r for r in requirements if r.marker and r.marker.evaluate({"extra": extra}) and not r.marker.evaluate({"extra": ""})]
    named = [r for r in only if r.name != DISTRIBUTION]
    lacking = [f"{r.name}: {_installed_version(r)[0]}" for r in named if not _installed_version(r)[1]]
    if lacking:
        return Finding("extras", extra, f"{'; '.join(lacking)} (pip install '{DISTRIBUTION}[{extra}]')", "missing")
    return Finding("extras", extra, ", ".join(f"{r.name} {_installed_version(r)[0]}" for r in named))


def _installed_version(requirement: Requirement) -> tuple[str, bool]:
    """The version that is installed, and whether it is one that is asked for."""
    try:
        version = metadata.version(requirement.name)
    except metadata.PackageNotFoundError:
        return "not installed", False
    if requirement.specifier.contains(version, prereleases=True):
        return version, True
    return f"{version}, needed is {requirement.specifier}", False


def _tool_findings() -> Iterator[Finding]:
    from ...core.errors import InputError
    from ...export.fmu.compiler import compiler_version, find_compiler

    try:
        yield Finding("tools", "C compiler", compiler_version(tuple(find_compiler())))
    except (InputError, OSError) as error:
        yield Finding("tools", "C compiler", str(error), "missing")
    yield _program_finding("OpenModelica", "omc", "--version")


def _program_finding(name: str, program: str, option: str) -> Finding:
    """A program that says its version."""
    path = shutil.which(program)
    if path is None:
        return Finding("tools", name, f"no program {program}", "missing")
    try:
        said = subprocess.run([path, option], capture_output=True, text=True, check=True, timeout=5)  # noqa: S603
    except (OSError, subprocess.SubprocessError) as error:
        return Finding("tools", name, f"{path} does not work: {error}", "missing")
    return Finding("tools", name, said.stdout.partition("\n")[0].strip())


def _sandbox_findings() -> Iterator[Finding]:
    from ...process.sandbox import find_available_sandboxes, landlock, probe_restrictions

    offered = find_available_sandboxes()
    if offered.landlock:
        kinds = ["files", *(["TCP"] if offered.landlock >= landlock.NETWORK_ABI else [])]
        yield Finding("sandbox", "Landlock", f"version {offered.landlock}: can confine {', '.join(kinds)}; not UDP")
    else:
        yield Finding("sandbox", "Landlock", "not in this kernel (Linux 5.13 or newer)", "missing")
    if offered.bubblewrap:
        yield Finding("sandbox", "bubblewrap", f"{offered.bubblewrap} works: --sandbox strict can be used")
    else:
        yield Finding("sandbox", "bubblewrap", "no program bwrap that works here, so no --sandbox strict", "missing")
    yield from (
        Finding("this process", name.replace("_", " "), _yes_or_no(value)) for name, value in asdict(probe_restrictions()).items()
    )


def _yes_or_no(value: Any) -> str:
    return {True: "yes", False: "no", None: "unlimited"}[value] if value is None or isinstance(value, bool) else str(value)
