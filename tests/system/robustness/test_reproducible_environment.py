"""Waves and gusts are the same bytes in every run of a seed, and others for another seed."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

import pytest
from command_folder import CommandFolder
from plant_validation import MeasurementCheck

import cosim

SAME = "Determinism and saved states"
SCENARIOS = ("demo1_waves", "demo1_wind", "demo1_current")


def digest_here(scenario: str, folder: Path, parameters: dict[str, int]) -> str:
    """The digest of a run in this process."""
    cosim.run(scenario, parameters, stop_time=3).to_csv(folder / "result.csv")
    return sha256((folder / "result.csv").read_bytes()).hexdigest()


def digest(workplace: CommandFolder, scenario: str, **environment: str) -> str:
    """The digest of a run in a separate process."""
    words = ("run", scenario, "--stop-time", "3", "--output-dir", "out", "--no-report")
    process = workplace.start(*words, environment=environment, cwd=workplace.folder)
    _, errors = process.communicate(timeout=100)
    assert process.returncode in (0, 3), errors  # the landing is not reached
    return sha256((workplace.folder / "out/result.csv").read_bytes()).hexdigest()


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The digests of runs in this process, which has done other things before."""
    return {name: digest_here(name, tmp_path_factory.mktemp(name), {}) for name in SCENARIOS}


@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("seed", ["31337"])
def test_hash_seeds_do_not_matter(
    workplace: CommandFolder,
    expected: dict[str, str],
    scenario: str,
    seed: str,
    measured: MeasurementCheck,
) -> None:
    others = int(digest(workplace, scenario, PYTHONHASHSEED=seed) != expected[scenario])
    measured(
        SAME,
        "other SHA-256 of result.csv",
        others,
        0,
        "1",
        "another process and PYTHONHASHSEED",
        case=scenario,
    )


def test_threads_do_not_matter(workplace: CommandFolder, expected: dict[str, str]) -> None:
    assert (
        digest(workplace, "demo1_waves", OMP_NUM_THREADS="2", OPENBLAS_NUM_THREADS="2")
        == expected["demo1_waves"]
    )


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_another_seed_is_another_run(
    tmp_path: Path, expected: dict[str, str], scenario: str
) -> None:
    assert (
        digest_here(scenario, tmp_path, {"/components/plant/arguments/environment/seed": 99})
        != expected[scenario]
    )


@pytest.mark.long
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_ten_repeats(
    workplace: CommandFolder, expected: dict[str, str], scenario: str, measured: MeasurementCheck
) -> None:
    others = sum(digest(workplace, scenario) != expected[scenario] for _ in range(10))
    measured(
        SAME,
        "other SHA-256 of result.csv in ten repeats",
        others,
        0,
        "1",
        "the first run",
        case=scenario,
    )
