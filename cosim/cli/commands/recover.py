"""`cosim recover`: results of a run that could not write them when it ended, or that was killed."""

from __future__ import annotations

from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, cast

import click

from ...core.errors import CosimError, InputError
from ...core.text import count_noun
from ..options import PATH
from ..unfinished_runs import OutputFiles, how_to_recover

if TYPE_CHECKING:
    from ...core.recording import Recording


@click.command()
@click.argument("output", type=PATH)
def command(output: Path) -> None:
    """Write the results of a run that could not write them (as on a full disk) or that was killed.

    OUTPUT is the output directory of `cosim run`, or the output file of `cosim simulate`. Writes
    result.csv, kpis.json and run.json, or the output file, and removes the rows that were kept.
    Then `cosim report` and `cosim plot` draw the run.
    """
    from ...process.output_lock import acquire_lock

    target = output.absolute()
    files = OutputFiles.of_folder(target) if target.is_dir() else OutputFiles.of_file(target)
    if not files.unfinished.is_dir():
        raise InputError(
            f'no rows were kept for "{output}"; expected an output directory or an output file'
        )
    lock = acquire_lock(files.lock, output)
    try:
        _recover(files.unfinished, target, output)
    finally:
        lock.release()


def _recover(unfinished: Path, target: Path, shown: Path) -> None:
    """Write the results from the rows in the folder `unfinished`, and remove it."""
    from ...process.run_files import read_metadata
    from ...results import Result, RunMetadata
    from ...results.result import write_run

    recording, count = _read_recording(unfinished)
    metadata = read_metadata(unfinished)
    kpis, timing = metadata.pop("kpis", {}), metadata.pop("timing", {})
    metadata.setdefault("failure", "killed")
    result = Result(recording, kpis, timing, cast(RunMetadata, metadata))
    try:
        if target.is_dir():
            write_run(result, target)
        else:
            result.to_csv(target)
    except CosimError as error:
        raise type(error)(f"{error}; {how_to_recover(result, unfinished, shown, error)}") from None
    rmtree(unfinished)
    rows = len(result.time)
    text = count_noun(rows, "row") if rows == count else f"{rows} of {count_noun(count, 'row')}"
    click.echo(f"{text} until t = {result.time[-1]:g} s in {shown}")


def _read_recording(unfinished: Path) -> tuple[Recording, int]:
    """Return the rows of an unfinished run that can be read, and the number of recorded rows."""
    from ...core.recording import Recording
    from ...process.run_files import HEADER_FILE, ROWS_FILE, RowsFile, find_kept_rows

    rows_file = RowsFile.open(unfinished)
    path, count = find_kept_rows(unfinished) or (unfinished / ROWS_FILE, 0)
    try:
        if rows_file:
            count = count or rows_file.count_rows()
        recording = rows_file.recording(count) if rows_file else Recording.empty()
    except (ValueError, TypeError, LookupError, ArithmeticError) as error:  # a damaged header
        raise InputError(
            f'cannot read "{unfinished / HEADER_FILE}": {error}; the rows stay in "{path}"'
        ) from error
    if not len(recording.time):
        raise InputError(
            f'only 0 of {count_noun(count, "row")} in "{path}" can be read: it or "{HEADER_FILE}" '
            "is damaged"
        )
    return recording, count
