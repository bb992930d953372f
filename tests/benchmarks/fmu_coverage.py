"""Table of the FMUs in a folder that cosim and other importers simulate with all defaults.

    python tests/benchmarks/fmu_coverage.py FOLDER [--environments DIR] [--only NAME ...]
    [--time-limit SECONDS]
        [--table FILE] [--json FILE]

Tries each *.fmu below FOLDER in a process of its own with each importer, from the start to the stop
time of its default experiment. An importer counts as successful if it reaches the stop time.
Creates a virtual environment for each other importer below DIR, unless it exists. `--table` writes
docs/public_fmus.csv. The FMUs contain foreign code, which runs with the rights of this process.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from zipfile import BadZipFile, ZipFile

from peer_comparison import last_line
from virtual_environments import environment

from cosim.export.foreign import windows_fmus

DRIVERS = Path(__file__).parent / "peers"
#: other importers: name -> driver and requirements
PEERS: Mapping[str, tuple[str, Sequence[str]]] = {
    "FMPy": ("try_fmpy.py", ["fmpy"]),
    "Ecos": ("try_ecos.py", ["ecospy", "tbb"]),
    "libcosim": ("try_libcosim.py", ["libcosimpy"]),
}
_PLATFORMS = {
    "linux64": "linux64",
    "x86_64-linux": "linux64",
    "win64": "win64",
    "x86_64-windows": "win64",
}


@dataclass(frozen=True)
class Subject:
    """An FMU with the defaults that an importer needs: times in s."""

    path: Path
    label: str
    version: str
    kinds: str
    tool: str
    binary: str
    start: float
    stop: float
    step: float


@dataclass(frozen=True)
class Attempt:
    """Outcome of one importer: it reached the stop time, or the last line of its messages."""

    reached_end: bool
    reason: str = ""


def read_subject(path: Path, folder: Path) -> Subject:
    """Read the facts of an FMU that the table shows; "?" if they cannot be read."""
    try:
        with ZipFile(path) as archive:
            root = ElementTree.fromstring(archive.read("modelDescription.xml"))  # noqa: S314 - a benchmark
            names = [name.replace("\\", "/") for name in archive.namelist()]
    except (BadZipFile, KeyError, ElementTree.ParseError):
        return Subject(path, str(path.relative_to(folder)), "?", "?", "?", "?", 0.0, 1.0, 0.01)
    experiment = next(iter(root.iter("DefaultExperiment")), None)
    times: Mapping[str, str] = {} if experiment is None else experiment.attrib
    start = float(times.get("startTime", 0))
    stop = float(times.get("stopTime", start + 1))
    step = float(times.get("stepSize", (stop - start) / 100))
    version = root.get("fmiVersion", "?")
    tool = root.get("generationTool", "-").split(" (")[0][:32]
    kinds = _kinds(root, version)
    return Subject(
        path, str(path.relative_to(folder)), version, kinds, tool, _binary(names), start, stop, step
    )


def _kinds(root: ElementTree.Element, version: str) -> str:
    if version.startswith("1"):
        implementation = root.find("Implementation")
        if implementation is None:
            return "ME"
        return "CS" if implementation.find("CoSimulation_StandAlone") is not None else "tool"
    kinds = {"CoSimulation": "CS", "ModelExchange": "ME", "ScheduledExecution": "SE"}
    return "+".join(short for name, short in kinds.items() if root.find(name) is not None)


def _binary(names: Sequence[str]) -> str:
    parts = [name.split("/") for name in names if name.endswith((".so", ".dll", ".dylib"))]
    folders = {part[1] for part in parts if len(part) > 2 and part[0] == "binaries"}
    platforms = {_PLATFORMS.get(folder, folder) for folder in folders}
    if "linux64" in platforms:
        return "linux64"
    sources = any(name.startswith("sources/") and name.endswith((".c", ".cpp")) for name in names)
    return "+".join([*(["sources"] if sources else []), *sorted(platforms)]) or "none"


def attempt(command: Sequence[str | Path], time_limit: float) -> Attempt:
    """Run an importer in a process group and a temporary folder of its own; it fails after
    `time_limit` (s, wall time).
    """
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            [*map(str, command)],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            errors="replace",
            start_new_session=True,
        )
        try:
            _, messages = process.communicate(timeout=time_limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return Attempt(False, f"exceeded {time_limit:g} s")
    if process.returncode < 0:
        return Attempt(False, f"{signal.Signals(-process.returncode).name}")
    return Attempt(process.returncode == 0, last_line(messages))


def importer_commands(
    subject: Subject, interpreters: Mapping[str, Path]
) -> dict[str, list[str | Path]]:
    """Return the command of each importer for an FMU."""
    times = [repr(subject.start), repr(subject.stop), repr(subject.step)]
    own: list[str | Path] = [sys.executable, "-m", "cosim", "simulate", subject.path]
    return {"cosim": own} | {
        n: [python, DRIVERS / PEERS[n][0], subject.path, *times]
        for n, python in interpreters.items()
    }


def write_table(rows: Sequence[tuple[Subject, Mapping[str, Attempt]]], target: Path) -> None:
    """Write a CSV file with a row per FMU."""
    with target.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["fmu", "tool", "fmi", "kinds", "binary", *rows[0][1]])
        for subject, attempts in rows:
            outcomes = ["yes" if each.reached_end else "no" for each in attempts.values()]
            about = [subject.label, subject.tool, subject.version, subject.kinds, subject.binary]
            writer.writerow([*about, *outcomes])


def print_summary(rows: Sequence[tuple[Subject, Mapping[str, Attempt]]]) -> None:
    """Print the number of successes by FMI version and kind of binary."""
    totals, reached = Counter[tuple[str, str]](), Counter[tuple[str, str, str]]()
    for subject, attempts in rows:
        binary = "none for this machine"
        if "linux64" in subject.binary:
            binary = "Linux"
        elif "sources" in subject.binary or "win64" in subject.binary:
            binary = "sources or Windows only"
        key = (subject.version[:1], binary)
        totals[key] += 1
        for name, each in attempts.items():
            reached[*key, name] += each.reached_end
    print("FMI | binary | FMUs |", " | ".join(rows[0][1]))
    for key, total in sorted(totals.items()):
        print(*key, total, *(reached[*key, name] for name in rows[0][1]), sep=" | ")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--environments", type=Path, default=Path.home() / ".cache/cosim-peers")
    parser.add_argument(
        "--only", nargs="*", default=list(PEERS), metavar="NAME", help=f"of {', '.join(PEERS)}"
    )
    parser.add_argument(
        "--time-limit",
        type=float,
        default=60.0,
        metavar="SECONDS",
        help="for one FMU and one importer",
    )
    parser.add_argument("--table", type=Path, help="CSV file with a row per FMU")
    parser.add_argument(
        "--json",
        type=Path,
        help="file for all outcomes; if it exists, those of the other importers are kept",
    )
    arguments = parser.parse_args()
    pythons = {
        name: environment(arguments.environments / PEERS[name][1][0], PEERS[name][1])
        for name in arguments.only
    }
    known = (
        json.loads(arguments.json.read_text()) if arguments.json and arguments.json.exists() else {}
    )
    rows: list[tuple[Subject, dict[str, Attempt]]] = []
    if wine := windows_fmus.find_wine():  # the first use takes a minute or two
        windows_fmus._prepared_prefix(wine)
        windows_fmus._built_worker()
    for path in sorted(arguments.folder.rglob("*.fmu")):
        subject = read_subject(path.resolve(), arguments.folder.resolve())
        earlier = {
            name: Attempt(*known[subject.label][name])
            for name in pythons
            if name in known.get(subject.label, {})
        }
        commands = importer_commands(subject, pythons)
        attempts = {
            name: earlier.get(name) or attempt(command, arguments.time_limit)
            for name, command in commands.items()
        }
        rows.append((subject, attempts))
        print(
            subject.label,
            *("+" if a.reached_end else "-" for a in attempts.values()),
            attempts["cosim"].reason[:150],
            flush=True,
        )
        if arguments.json:
            known[subject.label] = _as_json(subject, attempts)
            arguments.json.write_text(json.dumps(known, indent=1))
    print_summary(rows)
    if arguments.table:
        write_table(rows, arguments.table)


def _as_json(subject: Subject, attempts: Mapping[str, Attempt]) -> dict[str, Any]:
    outcomes = {name: [a.reached_end, a.reason] for name, a in attempts.items()}
    return {"fmi": subject.version, "kinds": subject.kinds, "binary": subject.binary, **outcomes}


if __name__ == "__main__":
    main()
