"""Manual pages, from what `--help` shows: one of `zfcal`, one of each command and subcommand.

The library for this, click-man, finds no command that is loaded when it is called, cuts first
sentences at 45 letters and fills the lines of examples.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import click

_EXITS = {
    "0": "Done, or nothing to do.",
    "1": "An error, which is named in one line with a hint.",
    "2": "Wrong usage.",
    "3": "Done, but an input was damaged and left out.",
    "4": "Scores disagree, or it is undecided whether they do (reproduce).",
    "75": "The same command is at work on the same trial.",
    "130, 143": "Ended by Ctrl-C, or by SIGTERM.",
}
"""As `docs/commands.md` lists them."""


def write_pages(
    group: click.Group, folder: Path, tasks: Mapping[str, Sequence[str]], version: str
) -> list[Path]:
    """Write all pages into a folder, which is made if need be; return their paths.

    Parameters
    ----------
    group
        The whole command line.
    folder
        Gets ``zfcal.1``, ``zfcal-init.1`` and so on; such as ``~/.local/share/man/man1``.
    tasks
        What people come to do, and the commands for it.
    version
        Of zfcal.
    """
    from zfcal.artifacts.atomic import write_text_whole

    written = []
    for context in _contexts(click.Context(group, info_name="zfcal")):
        path = folder / f"{context.command_path.replace(' ', '-')}.1"
        write_text_whole(path, page(context, tasks if context.parent is None else {}, version))
        written.append(path)
    return written


def _contexts(context: click.Context) -> Iterator[click.Context]:
    """Yield the context of a command, then those of its subcommands."""
    yield context
    if isinstance(context.command, click.Group):
        for name in context.command.list_commands(context):
            command = context.command.get_command(context, name)
            if command is not None and not command.hidden:
                yield from _contexts(click.Context(command, info_name=name, parent=context))


def page(context: click.Context, tasks: Mapping[str, Sequence[str]], version: str) -> str:
    """Return a manual page in roff.

    Parameters
    ----------
    context
        Of the command.
    tasks
        Its subcommands by what they are for; empty to list them in their order.
    version
        Of zfcal.
    """
    command, name = context.command, context.command_path
    first, *rest = re.split(r"\n\s*\n", (command.help or "").strip())
    usage = [_shown(piece) for piece in command.collect_usage_pieces(context)]
    lines = [
        f'.TH "{name.replace(" ", "-").upper()}" "1" "" "zfcal {version}" "zfcal manual"',
        ".SH NAME",
        f"{_shown(name.replace(' ', '-'))} \\- {_shown(_sentence(first).rstrip('.'))}",
        ".SH SYNOPSIS",
        f".B {_shown(name)}",
        *usage,
        ".SH DESCRIPTION",
    ]
    for paragraph in (first, *rest):
        lines += _paragraph(paragraph)
    lines += [".SH OPTIONS", *_options(context)]
    if isinstance(command, click.Group):
        lines += [".SH COMMANDS", *_commands(context, command, tasks)]
    lines.append(".SH EXIT STATUS")
    for code, meaning in _EXITS.items():
        lines += [".TP", f".B {code}", _shown(meaning)]
    if context.parent is not None:
        above = context.parent.command_path.replace(" ", "-")
        lines += [".SH SEE ALSO", f".BR {_shown(above)} (1)"]
    return "\n".join(lines) + "\n"


def _sentence(paragraph: str) -> str:
    """Return the first sentence of a paragraph, on one line."""
    text = " ".join(paragraph.split())
    return re.split(r"(?<=\.)\s", text, maxsplit=1)[0]


def _paragraph(text: str) -> list[str]:
    """Return a paragraph; the lines of one that begins with a backspace stay as they are."""
    kept = text.lstrip()
    if not kept.startswith("\b"):
        return [".PP", _shown(" ".join(text.split()))]
    lines = textwrap.dedent(kept.removeprefix("\b").strip("\n")).splitlines()
    return [".PP", ".nf", *map(_shown, lines), ".fi"]


def _options(context: click.Context) -> Iterator[str]:
    for parameter in context.command.get_params(context):
        record = parameter.get_help_record(context)
        if record is not None and isinstance(parameter, click.Option):
            option, text = record
            yield from (".TP", f"\\fB{_shown(option)}\\fP", _shown(" ".join(text.split())))


def _commands(
    context: click.Context, group: click.Group, tasks: Mapping[str, Sequence[str]]
) -> Iterator[str]:
    for task, names in (tasks or {"": group.list_commands(context)}).items():
        if task:
            yield f".SS {_shown(task)}"
        for name in names:
            command = group.get_command(context, name)
            if command is not None:
                full = _shown(f"{context.command_path}-{name}".replace(" ", "-"))
                text = _sentence(command.help or "")
                yield from (".TP", f".BR {full} (1)", _shown(text))


def _shown(text: str) -> str:
    """Return text as roff shows it: no sign of it is an order to the formatter."""
    escaped = text.replace("\\", "\\e").replace("-", "\\-").replace("^", "\\(ha")
    escaped = escaped.replace("~", "\\(ti").replace("`", "\\(ga").replace("'", "\\(aq")
    return f"\\&{escaped}" if escaped.startswith(".") else escaped
