"""Option of commands that write CSV files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from ..core.csv_text import set_excel_safe


def _apply(_context: click.Context, _option: click.Parameter, enabled: bool) -> None:
    set_excel_safe(enabled)


_excel_safe = click.option(
    "--excel-safe",
    is_flag=True,
    expose_value=False,
    callback=_apply,
    help=(
        "In CSV files, write an apostrophe before texts that begin with = + - or @, which "
        "spreadsheets take for formulas."
    ),
)


def csv_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the option `--excel-safe` to a command."""
    return _excel_safe(command)
