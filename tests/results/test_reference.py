"""References: selection of rows, and provenance."""

import json

import numpy as np
import pytest

from cosim.core.errors import CheckError
from cosim.core.recording import Recording
from cosim.results import Result
from cosim.results.comparison import compare
from cosim.results.reference import (
    decimate,
    describe_provenance_changes,
    write_reference,
)
from cosim.results.tolerance_tube import Tolerance

TIME = np.arange(2001) / 100
SWITCH = TIME >= 7.77
METADATA = {
    "name": "swing",
    "versions": {"numpy": "2"},
    "machine": {"system": "Linux"},
    "sha256": {"a.fmu": "12"},
    "timing": 3,
}


def swing(**columns):
    columns = {
        "a.x": np.sin(TIME) * np.exp(-TIME / 5),
        "a.on": SWITCH,
        "b": np.cos(9 * TIME),
        **columns,
    }
    return Result(Recording(TIME, columns, dict.fromkeys(columns, "m")), metadata=METADATA)


TOLERANCES = {"a.x": Tolerance(absolute=0.01), "a.on": Tolerance(time=0.1)}


def test_few_rows_describe_the_run_closely():
    reference = decimate(swing(), TOLERANCES)
    assert list(reference) == ["a.x", "a.on"]
    assert len(reference.time) < 120
    assert (reference.time[0], reference.time[-1]) == (0, 20)
    assert compare(
        swing(), reference, {name: part.scaled(0.25) for name, part in TOLERANCES.items()}
    ).passed


def test_rows_are_dense_where_the_signal_changes():
    time = decimate(swing(), TOLERANCES).time
    before, after = time[time < 7.77][-1], time[time >= 7.77][0]
    assert after - before <= 0.05
    assert np.diff(time).max() == pytest.approx(0.64)


def test_without_a_tolerance_every_row_that_matters_is_kept():
    assert len(decimate(swing(), {"b": Tolerance()}).time) == 2001


def test_rows_with_changed_strings_are_selected():
    phases = np.where(SWITCH, "land", "climb").astype(object)
    reference = decimate(swing(phase=phases), {"phase": Tolerance()})
    assert next(iter(reference.time[reference["phase"] == "land"])) == 7.77


def test_the_same_run_writes_the_same_bytes(tmp_path):
    for name in ("first", "second"):
        write_reference(swing(), tmp_path / f"{name}.csv", TOLERANCES)
    for suffix in (".csv", ".json"):
        assert (tmp_path / f"first{suffix}").read_bytes() == (
            tmp_path / f"second{suffix}"
        ).read_bytes()
    about = json.loads((tmp_path / "first.json").read_text())
    assert about == {
        **{key: METADATA[key] for key in ("name", "versions", "machine", "sha256")},
        "signals": 2,
        "rows": about["rows"],
    }


def test_written_rows_are_recorded_ones_rounded_to_a_hundredth_of_the_tolerance(tmp_path):
    run = swing()
    write_reference(run, tmp_path / "r.csv", TOLERANCES | {"b": Tolerance(time=0.05)})
    read = Result.from_csv(tmp_path / "r.csv")
    rows = np.flatnonzero(np.isin(TIME, read.time))
    assert np.array_equal(read["a.x"], np.round(run["a.x"][rows], 4))
    assert np.array_equal(read["b"], run["b"][rows])


@pytest.mark.parametrize(
    ("run", "tolerances", "reason"),
    [
        (swing(c=np.where(TIME == 3, np.nan, 0)), {"c": Tolerance(1)}, "c is nan at t = 3 s"),
        (
            swing(),
            {"a.x": Tolerance(1), "a.z": Tolerance(1)},
            '^this run is no reference: "a.z" matches no recorded signal',
        ),
        (
            swing(),
            {"a.[xy]": Tolerance(1)},
            r'"a.\[xy\]" matches no recorded signal; only "\*" is a wildcard$',
        ),
    ],
)
def test_a_run_that_fails_its_own_comparison_is_refused(run, tolerances, reason, tmp_path):
    with pytest.raises(CheckError, match=reason):
        write_reference(run, tmp_path / "r.csv", tolerances)
    assert list(tmp_path.iterdir()) == []


def test_changes_name_what_is_different():
    later = {
        "versions": {"numpy": "3"},
        "machine": {"system": "Linux"},
        "sha256": {"a.fmu": "13", "b.py": "7"},
    }
    assert describe_provenance_changes(METADATA, METADATA) == []
    assert describe_provenance_changes(METADATA, later) == ["numpy 2 -> 3", "a.fmu", "b.py"]


def test_a_changed_module_is_named_unless_its_folder_has_many(tmp_path):
    few = {f"controllers/{name}.py": "1" for name in ("a", "b")}
    many = {f"plant/m{i}.py": "1" for i in range(9)}
    data = {f"vehicles/{i}.json": "1" for i in range(9)}
    run = Result(swing().recording, metadata={**METADATA, "sha256": few | many | data})
    write_reference(run, tmp_path / "r.csv", TOLERANCES)
    made_by = json.loads((tmp_path / "r.json").read_text())
    assert sorted(made_by["sha256"]) == [
        "controllers/a.py",
        "controllers/b.py",
        "plant/*.py",
        *data,
    ]
    assert describe_provenance_changes(made_by, run.metadata) == []
    changed = {"sha256": few | many | data | {"controllers/b.py": "2", "plant/m3.py": "2"}}
    assert describe_provenance_changes(made_by, {**run.metadata, **changed}) == [
        "controllers/b.py",
        "plant/*.py",
    ]
    older = {
        **made_by,
        "sha256": {"controllers/*.py": "one hash of all"},
    }  # references of older versions
    assert describe_provenance_changes(older, {**run.metadata, "sha256": few}) == [
        "controllers/*.py"
    ]


def test_an_angle_that_jumps_by_a_turn_needs_few_rows():
    angle = np.angle(np.exp(1j * (np.pi + 0.3 * np.sin(TIME))))
    run = Result(Recording(TIME, {"yaw": angle}, {"yaw": "rad"}))
    reference = decimate(run, {"yaw": Tolerance(absolute=0.01)})
    assert len(reference.time) < 100
    later = Result(
        Recording(
            TIME,
            {"yaw": np.angle(np.exp(1j * (np.pi + 0.3 * np.sin(TIME - 0.02))))},
            {"yaw": "rad"},
        )
    )
    assert compare(later, reference, {"yaw": Tolerance(absolute=0.01)}).passed
