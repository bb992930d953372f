"""`cosim recover`: results of a run that could not be written when it ended."""

from __future__ import annotations

from pathlib import Path
from shutil import rmtree

import click

from ...core.errors import CosimError, InputError
from ...core.text import count_noun
from ..unfinished_runs import OutputFiles, how_to_recover


@click.command()
@click.argument("output", type=click.Path(path_type=Path))
def command(output: Path) -> None:
    """Write the results of a run that could not be written when it ended, as on a full disk.

    OUTPUT is the output directory of `cosim run`, or the output file of `cosim simulate`. Writes result.csv, kpis.json and
    run.json, or the output file, and removes the rows that were kept. Then `cosim report` and `cosim plot` draw the run.
    """
    from ...process.output_lock import acquire_lock

    target = output.absolute()
    files = OutputFiles.of_folder(target) if target.is_dir() else OutputFiles.of_file(target)
    if not files.unfinished.is_dir():
        raise InputError(f'no rows were kept for "{output}"; expected an output directory or an output file')
    lock = acquire_lock(files.lock, output)
    try:
        _recover(files.unfinished, target, output)
    finally:
        lock.release()


def _recover(unfinished: Path, target: Path, shown: Path) -> None:
    """Write the results from the rows in the folder `unfinished`, and remove it."""
    from ...process.run_files.folder import find_kept_rows, read_metadata, recover_recording
    from ...results import Result
    from ...results.result import write_run

    kept = find_kept_rows(unfinished)
    if kept is None:
        file = shown / "result.csv" if target.is_dir() else shown
        raise InputError(f'no rows were kept for "{shown}": its run was killed; the rows until shortly before are in "{file}"')
    rows_file, count = kept
    metadata = read_metadata(unfinished)
    kpis, timing = metadata.pop("kpis", {}), metadata.pop("timing", {})
    result = Result(recover_recording(unfinished, count, rows_file), kpis, timing, metadata)
    try:
        if target.is_dir():
            write_run(result, target)
        else:
            result.to_csv(target)
    except CosimError as error:
        raise type(error)(f"{error}; {how_to_recover(result, unfinished, shown, error)}") from None
    rmtree(unfinished)
    click.echo(f"{count_noun(len(result.time), 'row')} until t = {result.time[-1]:g} s in {shown}")
