"""`cosim recover`: results of a run that could not be written when it ended."""

from __future__ import annotations

from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING

import click

from ...core.errors import CosimError, InputError
from ...core.text import count_noun
from ..unfinished_runs import OutputFiles, how_to_recover

if TYPE_CHECKING:
    from ...core.recording import Recording


@click.command()
@click.argument("output", type=click.Path(path_type=Path))
def command(output: Path) -> None:
    """Write the results of a run that could not be written when it ended, as on a full disk.

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
    from ...process.run_files.folder import find_kept_rows, read_metadata
    from ...results import Result
    from ...results.result import write_run

    kept = find_kept_rows(unfinished)
    if kept is None:
        file = shown / "result.csv" if target.is_dir() else shown
        raise InputError(
            f'no rows were kept for "{shown}": its run was killed; the rows until shortly before '
            f'are in "{file}"'
        )
    rows_file, count = kept
    metadata = read_metadata(unfinished)
    kpis, timing = metadata.pop("kpis", {}), metadata.pop("timing", {})
    csv = target / "result.csv" if target.is_dir() else target
    result = Result(_read_recording(unfinished, count, rows_file, csv), kpis, timing, metadata)
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


def _read_recording(unfinished: Path, count: int, rows_file: Path, csv: Path) -> Recording:
    """Return the `count` rows of a file, or those that are left of them.

    Never replace a CSV file by fewer rows.
    """
    from ...process.run_files.folder import HEADER_FILE, recover_recording

    try:
        recording = recover_recording(unfinished, count, rows_file)
    except (ValueError, TypeError, LookupError, ArithmeticError) as error:  # a damaged header
        raise InputError(
            f'cannot read "{unfinished / HEADER_FILE}": {error}; the rows stay in "{rows_file}"'
        ) from error
    rows = len(recording.time)
    if not rows or (rows < count and csv.exists()):
        hint = (
            (
                f'; "{csv}" has the rows that were written during the run, remove it to write '
                "those that can be read"
            )
            if rows
            else ""
        )
        raise InputError(
            f'only {rows} of {count} rows in "{rows_file}" can be read: it or "{HEADER_FILE}" is '
            f"damaged{hint}"
        )
    return recording
