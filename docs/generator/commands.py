"""Reference of the command line, from the definitions of the commands."""

from __future__ import annotations

import inspect
from collections.abc import Iterator

import click
from markdown_parts import code, page, plain, table

from cosim.cli import COMMANDS, cli


def commands_page() -> str:
    """Return the page with all commands, their arguments and options."""
    root = click.Context(cli, info_name="cosim")
    sections = [_options(root)]
    for name in COMMANDS:
        command = cli.get_command(root, name)
        assert command
        sections += _sections(click.Context(command, root, name))
    return page("Command line", *sections)


def _sections(context: click.Context) -> Iterator[str]:
    """Yield heading, usage, text and options of a command and of its subcommands."""
    command = context.command
    yield f"## {context.command_path}"
    yield (
        f"```text\n{' '.join((context.command_path, *command.collect_usage_pieces(context)))}\n```"
    )
    yield plain(inspect.cleandoc(command.help or ""))
    yield _options(context)
    if isinstance(command, click.Group):
        for name, child in command.commands.items():
            yield from (
                section.replace("## ", "### ", 1)
                for section in _sections(click.Context(child, context, name))
            )


def _options(context: click.Context) -> str:
    records = [
        (option, option.get_help_record(context))
        for option in context.command.get_params(context)
        if isinstance(option, click.Option) and "--help" not in option.opts
    ]
    return table(
        ("option", "purpose"),
        ((code(record[0]), plain(record[1])) for _, record in records if record),
    )
