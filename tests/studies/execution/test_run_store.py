"""Store of finished runs."""

import pytest

from cosim.core.errors import InputError
from cosim.studies.execution.job import Job, Record, run_key
from cosim.studies.execution.run_store import RUN_STORE_FILE, RunStore

KEYS = [run_key("scenario", {"run": run}) for run in range(4)]


def filled(folder, *records):
    with RunStore(folder) as run_store:
        for record in records:
            run_store.add(record)
    return folder / RUN_STORE_FILE


def test_records_are_read_back(tmp_path):
    records = [
        Record(KEYS[0], {"a": 0.1, "b": True, "c": float("inf")}, seconds=1.5),
        Record(KEYS[1], failure="no", output="x\ny"),
    ]
    filled(tmp_path, *records)
    with RunStore(tmp_path) as run_store:
        assert [run_store[key] for key in KEYS[:2]] == records
        assert [key in run_store for key in KEYS] == [True, True, False, False]


def test_an_incomplete_last_line_is_cut_off(tmp_path):
    file = filled(tmp_path, Record(KEYS[0], {"a": 1.0}), Record(KEYS[1], {"a": 2.0}))
    whole = file.read_bytes()
    for length in range(len(whole) - 1, whole.index(b"\n"), -7):
        file.write_bytes(whole[:length])
        filled(tmp_path, Record(KEYS[1], {"a": 3.0}))
        with RunStore(tmp_path) as run_store:
            assert [run_store[key].kpis["a"] for key in KEYS[:2]] == [1.0, 3.0]


LINES = [
    b"\0" * 20,
    b"{",
    b'{"key": "zz"}',
    b'{"key": "00", "kpis": 3}',
    b"[1]",
    b"\xff",
    b"[" * 100_000,
    b"1" * 5000,
]
LINES += [
    b'{"key": "00", "kpis": {"a": %s}}' % value
    for value in (b'"text"', b'{"b": 1}', b"[1]", b"null", b"1" + b"0" * 400)
]
LINES += [
    b'{"key": "00", %s}' % field
    for field in (b'"seconds": "x"', b'"failure": 1', b'"output": null', b'"more": 1')
]


@pytest.mark.parametrize("line", LINES, ids=range(len(LINES)))
def test_an_unreadable_line_does_not_affect_the_others(tmp_path, line):
    file = filled(tmp_path, Record(KEYS[0], {"a": 1.0}))
    file.write_bytes(file.read_bytes() + line + b"\n")
    filled(tmp_path, Record(KEYS[1], {"a": 2.0}))
    with RunStore(tmp_path) as run_store:
        assert [run_store[key].kpis["a"] for key in KEYS[:2]] == [1.0, 2.0]
        assert run_store.unreadable_lines == 1


@pytest.mark.parametrize("content", [b"notes\nof mine\n", b"notes", b'{"time": 1}\n'])
def test_a_foreign_file_is_refused_and_not_changed(tmp_path, content):
    (tmp_path / RUN_STORE_FILE).write_bytes(content)
    with pytest.raises(InputError, match="is not a file of finished runs"):
        RunStore(tmp_path)
    assert (tmp_path / RUN_STORE_FILE).read_bytes() == content


def test_a_file_with_only_an_incomplete_line_is_accepted(tmp_path):
    (tmp_path / RUN_STORE_FILE).write_bytes(b'{"key": "0123')
    filled(tmp_path, Record(KEYS[0]))
    with RunStore(tmp_path) as run_store:
        assert KEYS[0] in run_store


def test_each_unfinished_job_is_claimed_once(tmp_path):
    filled(tmp_path, Record(KEYS[0]))
    with RunStore(tmp_path) as run_store:
        jobs = [Job(KEYS[n], {}) for n in (0, 1, 2, 1)]
        assert [job.key for job in run_store.claim_jobs(jobs)] == [KEYS[1], KEYS[2]]


def test_failed_runs_are_unfinished_with_retry_failed(tmp_path):
    filled(tmp_path, Record(KEYS[0], {"a": 1}), Record(KEYS[1], failure="no"))
    with RunStore(tmp_path, retry_failed=True) as run_store:
        assert [key in run_store for key in KEYS[:2]] == [True, False]
        run_store.add(Record(KEYS[1], {"a": 2}))
    with RunStore(tmp_path) as run_store:
        assert run_store[KEYS[1]] == Record(KEYS[1], {"a": 2})


def test_a_folder_is_locked_against_a_second_sweep(tmp_path):
    with RunStore(tmp_path), pytest.raises(InputError, match="is in use by process"):
        RunStore(tmp_path)
    RunStore(tmp_path).__enter__().__exit__()


def test_a_key_depends_on_files_and_settings_but_not_on_their_order():
    assert run_key("a", {"x": 1, "y": 2}) == run_key("a", {"y": 2, "x": 1})
    assert (
        len(
            {
                run_key("a", {"x": 1}),
                run_key("b", {"x": 1}),
                run_key("a", {"x": 2}),
                run_key("a", {"z": 1}),
            }
        )
        == 4
    )
