"""Shell completion of names of shipped files, beside paths."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click
from click.shell_completion import CompletionItem

from ..core import resources

#: function that returns what may complete a word
Completion = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def complete_shipped(pattern: str) -> Completion:
    """Return a completion by the names of the shipped files that match a pattern, and by the JSON files of the user.

    The shell completes other paths if none of these fits.
    """

    def complete(
        _context: click.Context, _parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        folder = Path(incomplete).parent if not incomplete.endswith("/") else Path(incomplete)
        files = sorted(str(path) for path in folder.glob("*.json"))
        names = [
            name
            for name in (*resources.shipped_names(pattern), *files)
            if name.startswith(incomplete)
        ]
        return [CompletionItem(incomplete, type="file"), *map(CompletionItem, names)]

    return complete


complete_scenario = complete_shipped("scenarios/*.json")
complete_study = complete_shipped("scenarios/sweeps/*.json")
complete_role = complete_shipped("scenarios/roles/*.json")
