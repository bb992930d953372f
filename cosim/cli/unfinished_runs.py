"""Rows of runs whose results could not be written, kept for `cosim recover`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shutil import disk_usage
from typing import TYPE_CHECKING

from ..core.errors import CosimError, InputError, OutputError
from ..core.paths import resolve_path
from ..core.text import count_noun
from ..process.output_lock import LOCK_FILE

if TYPE_CHECKING:
    from ..results import Result

_UNFINISHED_FOLDER = ".unfinished"


@dataclass(frozen=True)
class OutputFiles:
    """Files that accompany an output while it is written.

    Attributes:
        unfinished: Folder of the rows, see `process.run_files`.
        lock: Lock file.
    """

    unfinished: Path
    lock: Path

    @classmethod
    def of_folder(cls, folder: Path) -> OutputFiles:
        """Return the files that accompany the output directory of `cosim run`."""
        return cls(folder / _UNFINISHED_FOLDER, folder / LOCK_FILE)

    @classmethod
    def of_file(cls, file: Path) -> OutputFiles:
        """Return the files that accompany the output file of `cosim simulate`.

        They lie beside the file itself if `file` is a symbolic link to it.
        """
        if file.is_symlink():
            file = resolve_path(file)
        return cls(
            file.with_name(f".{file.name}{_UNFINISHED_FOLDER}"),
            file.with_name(f".{file.name}{LOCK_FILE}"),
        )


@contextmanager
def writing_results(result: Result, folder: Path | None, shown: Path) -> Iterator[None]:
    """Write results in this block; their rows are kept if they cannot be written.

    Args:
        result: The result that the block writes.
        folder: Folder of the unfinished run; None if there is none.
        shown: The output as messages show it.

    Raises:
        InputError: The output cannot be written; the text says how to continue.
        OutputError: The same, on a full or defective disk.
    """
    from ..process.run_files import keep_rows
    from ..results.files import to_json_types

    try:
        yield
    except (InputError, OutputError) as error:
        if folder is None:
            raise
        about = {**result.metadata, "timing": result.timing, "kpis": result.kpis}
        try:
            keep_rows(folder, len(result.time), to_json_types(about))
        except OSError:
            raise error from None
        rows = count_noun(len(result.time), "row")
        raise type(error)(
            f"{error}; kept {rows}: {how_to_recover(result, folder, shown, error)}"
        ) from None


def how_to_recover(result: Result, folder: Path, shown: Path, error: CosimError) -> str:
    """Return an instruction for the user.

    The remedy for an error, and the `cosim recover` command to call afterwards.
    """
    from ..results.csv_files import BYTES_PER_NUMBER

    missing = len(result.time) * (len(result) + 1) * BYTES_PER_NUMBER - disk_usage(folder).free
    remedy = (
        f"free about {max(1, round(missing / 1e6))} MB"
        if isinstance(error, OutputError)
        else "remove the cause"
    )
    return f"{remedy}, then call `cosim recover {shown}`"
