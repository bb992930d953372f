"""Comparison of cosim, its peers and the C limit: one ring of near-empty FMUs, measured
alternately, in one table.

    python tests/benchmarks/peer_comparison.py FOLDER [--sizes 2 8 32 128] [--rounds 5] [--only NAME
    ...] [--document FILE]

Creates a virtual environment for each peer below FOLDER; this happens once and needs pip, a C
compiler and a minute or two. A peer that cannot be installed or fails is omitted, with the reason.
`--document` replaces the table between the marks of that file (docs/performance.md).
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import isnan, nan
from operator import attrgetter
from pathlib import Path
from statistics import median

import cosim_contender
from c_limit import CLimit
from lag_fmus import lag_fmu
from virtual_environments import environment, versions

from cosim.engine import ExecutorKind

DRIVERS = Path(__file__).parent / "peers"
TIME_LIMIT = 300.0
LIMIT = "C limit"


@dataclass(frozen=True)
class Peer:
    """A driver in peers/ and its requirements; it makes `budget` / instances steps, but at least
    `fewest`.
    """

    driver: str
    requirements: Sequence[str]
    budget: int
    fewest: int = 10

    def steps(self, size: int) -> int:
        return max(self.fewest, self.budget // size)


COSIM: Mapping[ExecutorKind, Peer] = {
    "native": Peer("ring_cosim.py", [], 1_000_000),
    "python": Peer("ring_cosim.py", [], 100_000),
}
PEERS: Mapping[str, Peer] = {
    "FMU Manipulation Toolbox": Peer("pack_fmt.py", ["fmu-manipulation-toolbox"], 1_000_000),
    "Ecos": Peer("ring_ecos.py", ["ecospy", "tbb"], 100_000),
    "libcosim": Peer("ring_libcosim.py", ["libcosimpy"], 20_000),
    "FMPy methods": Peer("ring_fmpy.py", ["fmpy"], 20_000),
    "FMPy simulate_ssp": Peer("ring_fmpy_ssp.py", ["fmpy"], 20_000, 1500),
    "SOFIRpy": Peer("ring_sofirpy.py", ["sofirpy"], 20_000, 1500),
    "CoFmuPy": Peer("ring_cofmupy.py", ["cofmupy"], 6_000),
    "SysSimX": Peer("ring_syssimx.py", ["syssimx", "fmpy"], 4_000),
    "PathSim": Peer("ring_pathsim.py", ["pathsim", "pathsim-fmi"], 2_500),
}


@dataclass(frozen=True)
class Cost:
    """CPU and wall time (us) per step and the last value of the ring; NaN without a measurement."""

    cpu: float = nan
    wall: float = nan
    last: float = nan


#: measures a ring of the given size
Contender = Callable[[int], Cost]


def run_c_limit(limit: CLimit, ring: bool = True) -> Contender:
    """Return a contender that steps with the program of the C limit; without `ring` the FMU
    contains the whole ring.
    """

    def run(size: int) -> Cost:
        cpu, last = limit.run(size if ring else 1, max(500, 1_000_000 // size), ring=ring)
        return Cost(cpu, cpu, last)

    return run


def run_driver(python: Path, peer: Peer, fmu: Path, *more: str) -> Contender:
    """Return a contender that steps with a driver, whose output is JSON."""

    def run(size: int) -> Cost:
        return Cost(**json.loads(driver_output(python, peer, fmu, size, peer.steps(size), *more)))

    return run


def run_packed(python: Path, peer: Peer, fmu: Path, folder: Path) -> Contender:
    """Return a contender that steps an FMU into which a driver packs the ring, once per size."""

    @cache
    def container(size: int) -> Contender:
        target = folder / f"container{size}.fmu"
        driver_output(python, peer, fmu, size, target)
        return run_c_limit(CLimit(target, folder), ring=False)

    return lambda size: container(size)(size)


def driver_output(python: Path, peer: Peer, *arguments: object) -> str:
    """Return the last line of a driver's output. Raises SubprocessError if it fails or exceeds the
    time limit.
    """
    command = [python, DRIVERS / peer.driver, *arguments]
    done = subprocess.run(
        [*map(str, command)], capture_output=True, text=True, timeout=TIME_LIMIT, check=True
    )
    return last_line(done.stdout)


def last_line(text: str) -> str:
    return next((line.strip() for line in reversed(text.splitlines()) if line.strip()), "")


class Comparison:
    """The contenders with their versions, and the absent peers with the reasons."""

    def __init__(self, folder: Path, environments: Path, names: Collection[str]):
        self._folder, self._fmu = folder, lag_fmu(folder)
        self.versions: dict[str, str] = {}
        self.absent: dict[str, str] = {}
        self._contenders: dict[str, Contender] = {LIMIT: run_c_limit(CLimit(self._fmu, folder))}
        for executor, peer in COSIM.items():
            if executor in cosim_contender.executors():
                self._contenders[cosim_contender.executor_label(executor)] = run_driver(
                    Path(sys.executable), peer, self._fmu, executor
                )
        for name, peer in PEERS.items():
            if name in names:
                self._add_peer(name, peer, environments / peer.requirements[0])

    def _add_peer(self, name: str, peer: Peer, folder: Path) -> None:
        try:
            python = environment(folder, peer.requirements)
        except subprocess.CalledProcessError as error:
            self.absent[name] = f"cannot be installed: {failure_reason(error)}"
            return
        self.versions[name] = versions(python, peer.requirements)
        if peer.driver.startswith("pack_"):
            self._contenders[name] = run_packed(python, peer, self._fmu, self._folder)
        else:
            self._contenders[name] = run_driver(python, peer, self._fmu)

    def measure(self, size: int, rounds: int) -> dict[str, Cost]:
        """Return the median costs for one size; a contender that fails is not measured again."""
        found: dict[str, list[Cost]] = {name: [] for name in self._contenders}
        for _ in range(rounds):
            for name, costs in found.items():
                if not costs or not isnan(costs[-1].cpu):
                    costs.append(self._cost(name, size))
        print(f"ring {size}: done", file=sys.stderr, flush=True)
        return {
            name: costs[-1] if isnan(costs[-1].cpu) else median_cost(costs)
            for name, costs in found.items()
        }

    def _cost(self, name: str, size: int) -> Cost:
        try:
            return self._contenders[name](size)
        except subprocess.SubprocessError as error:
            self.absent[f"{name}, ring {size}"] = failure_reason(error)
            return Cost()


def median_cost(costs: Sequence[Cost]) -> Cost:
    columns = zip(*map(attrgetter("cpu", "wall", "last"), costs), strict=True)
    return Cost(*map(median, columns))


def failure_reason(error: subprocess.SubprocessError) -> str:
    if isinstance(error, subprocess.CalledProcessError):
        return last_line(error.stderr) or f"exit code {error.returncode}"
    return f"time limit of {TIME_LIMIT:g} s exceeded"


def table(medians: Mapping[int, Mapping[str, Cost]], versions: Mapping[str, str]) -> list[str]:
    """Return the lines of a Markdown table: CPU time (us) per step and, in brackets, the ratio to
    the C limit.
    """
    lines = [
        "| contender | " + " | ".join(f"ring {size}" for size in medians) + " | y after the run |"
    ]
    lines.append("|---" * (len(medians) + 2) + "|")
    smallest = medians[min(medians)]
    for name, cost in smallest.items():
        label = f"{name} ({versions[name]})" if name in versions else name
        cells = [_cell(costs[name], costs[LIMIT]) for costs in medians.values()]
        lines.append(
            f"| {label} | {' | '.join(cells)} | {'-' if isnan(cost.last) else f'{cost.last:.6g}'} |"
        )
    return lines


def _cell(cost: Cost, limit: Cost) -> str:
    if isnan(cost.cpu):
        return "-"
    threads = f", wall {_number(cost.wall)}" if cost.wall < 0.75 * cost.cpu else ""
    return f"{_number(cost.cpu)} ({_number(cost.cpu / limit.cpu)}x{threads})"


def _number(value: float) -> str:
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def report(comparison: Comparison, sizes: Sequence[int], rounds: int) -> str:
    """Return the table with a description of machine and load."""
    load = os.getloadavg()[0]
    lines = table({size: comparison.measure(size, rounds) for size in sizes}, comparison.versions)
    lines += [
        "",
        (
            "Each cell contains CPU microseconds per macro step, and in parentheses the ratio to "
            "the C limit "
        ),
    ]
    lines[-1] += f"(median of {rounds} alternating rounds)."
    machine = f"CPython {platform.python_version()} on {os.cpu_count()} processors"
    lines += [
        f"{machine}; load average {load:.2f} at the start, {os.getloadavg()[0]:.2f} at the end."
    ]
    if comparison.absent:
        lines += [
            "",
            *(f"* Not measured: {name}: {why}." for name, why in comparison.absent.items()),
        ]
    return "\n".join(lines)


def write_into(document: Path, text: str, mark: str = "peers") -> None:
    """Replace the text between `<!-- MARK -->` and `<!-- /MARK -->`."""
    old = document.read_text()
    new, count = re.subn(
        rf"(<!-- {mark} -->\n).*?(<!-- /{mark} -->)",
        lambda m: f"{m[1]}{text}\n{m[2]}",
        old,
        flags=re.DOTALL,
    )
    if not count:
        raise SystemExit(f"{document} has no <!-- {mark} --> and <!-- /{mark} -->")
    document.write_text(new)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--sizes", type=int, nargs="+", default=[2, 8, 32, 128])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument(
        "--only", nargs="*", default=list(PEERS), metavar="NAME", help=f"of {', '.join(PEERS)}"
    )
    parser.add_argument("--document", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        comparison = Comparison(Path(folder), arguments.folder.resolve(), arguments.only)
        text = report(comparison, arguments.sizes, arguments.rounds)
    print(text)
    if arguments.document:
        write_into(arguments.document, text)


if __name__ == "__main__":
    main()
