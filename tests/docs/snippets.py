"""What the documentation tells people to type: read from the pages, and from help texts.

A page is Markdown; its commands stand in code blocks (indented or fenced) and in the text between
backticks. A line of a block may be a pipe, a loop, or a line of cron: what counts are the words
that follow `zfcal` in it.
"""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

import click
from markdown_it import MarkdownIt

SHELL = {"", "bash", "console", "sh"}
"""What a fenced block of commands says it is; an indented block says nothing."""

PLACEHOLDER = re.compile(r"[A-Z]+|.*[|{}].*").fullmatch
"""Tells what stands for a word that the reader is to choose: TRIAL, NAME, `csv|parquet`."""


@dataclass(frozen=True)
class Snippet:
    """A code block, or the code within a sentence."""

    page: str
    heading: str
    line: int
    language: str
    text: str
    is_block: bool

    @property
    def place(self):
        """Say where it stands, as compilers do."""
        return f"{self.page}:{self.line}"


@dataclass(frozen=True)
class Typed:
    """A command of zfcal that a page shows."""

    snippet: Snippet
    words: tuple[str, ...]

    @property
    def line(self):
        """Return the command as one line."""
        return shlex.join(("zfcal", *self.words))


def pages_of(repository):
    """Return the pages that people read, by their names."""
    names = ["README.md", "VISION.md", "data-samples/README.md"]
    found = sorted((repository / "docs").rglob("*.md"))
    return [*names, *(path.relative_to(repository).as_posix() for path in found)]


def snippets_of(repository, page):
    """Return all code of a page, in order."""
    heading, found = "", []
    tokens = (
        MarkdownIt("commonmark")
        .enable("table")
        .parse((repository / page).read_text(encoding="utf-8"))
    )
    line = 0
    for token, after in zip(tokens, [*tokens[1:], None], strict=True):
        line = token.map[0] + 1 if token.map else line
        if token.type == "heading_open":
            heading = after.content
        elif token.type in {"fence", "code_block"}:
            language = token.info.strip()
            found.append(Snippet(page, heading, line, language, token.content, is_block=True))
        elif token.type == "inline":
            found += [
                Snippet(page, heading, line, "", child.content, is_block=False)
                for child in token.children
                if child.type == "code_inline"
            ]
    return found


def statements_of(text):
    """Return the commands of a shell text, each as its words; what they are piped to is another."""
    lexer = shlex.shlex(text.replace("\\\n", " "), posix=True, punctuation_chars="();<>|&\n")
    lexer.whitespace = " \t\r"
    lexer.whitespace_split = True
    found = [[]]
    for word in lexer:
        if set(word) <= set("();<>|&\n"):
            found.append([])
        else:
            found[-1].append(word)
    return [words for words in found if words]


def typed_in(snippet):
    """Return the commands of zfcal in a snippet."""
    if snippet.is_block and snippet.language not in SHELL:
        return []
    try:
        statements = statements_of(snippet.text)
    except ValueError:  # an apostrophe in what a program prints
        statements = [words for text in snippet.text.splitlines() for words in _plain(text)]
    found = []
    for words in statements:
        starts = [n for n, word in enumerate(words) if _is_zfcal(word)]
        # Nothing but an assignment, a time of cron or the word of a shell goes before it.
        if starts and all(_leads(word) for word in words[: starts[0]]):
            found.append(Typed(snippet, tuple(words[starts[0] + 1 :])))
    return found


def _plain(text):
    try:
        return statements_of(text)
    except ValueError:
        return []


def _is_zfcal(word):
    return word == "zfcal" or word.endswith(("bin/zfcal", "=zfcal"))


def _leads(word):
    return word in {"*", "do", "then", "time", "nice", "exec", "$"} or "=" in word


def examples_of(command, words=()):
    """Yield the examples in the help of a command and of those below it, as `Typed`."""
    text = (command.help or "").partition("Example:\n")[2]
    page = f"zfcal {' '.join(words)} --help".replace("  ", " ")
    yield from typed_in(Snippet(page, "Example", 0, "", text, is_block=True))
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            yield from examples_of(command.get_command(context, name), (*words, name))


def find_command(group, words):
    """Return the command that words begin with, its context and the words that are left.

    Raises
    ------
    click.UsageError
        If there is none of that name.
    """
    context = click.Context(group, info_name="zfcal")
    command, left = group, list(words)
    while isinstance(command, click.Group) and left and not left[0].startswith("-"):
        name, command, left = command.resolve_command(context, left)
        context = click.Context(command, parent=context, info_name=name)
    return command, context, left


def commands_below(command):
    """Yield a command, and all that belong to it."""
    yield command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            yield from commands_below(command.get_command(context, name))


def options_of(command):
    """Return every spelling of every option that a command has and shows."""
    context = click.Context(command, help_option_names=["-h", "--help"])
    shown = [each for each in command.get_params(context) if not getattr(each, "hidden", False)]
    return {word for each in shown for word in (*each.opts, *each.secondary_opts)}


def fault_of(group, typed):
    """Return what is wrong with a command as a page shows it; None if it can be typed so.

    It is taken apart as click does when it is run: options exist, values are of their kind,
    arguments are there. Nothing runs, and files need not exist (see `any_path`). Within a sentence
    arguments may be missing, and with placeholders there names alone are looked at.
    """
    words = [word.strip("[]") for word in typed.words if word not in {"...", "…"}]
    is_block = typed.snippet.is_block
    if not is_block and words and PLACEHOLDER(words[0]):
        return None
    try:
        command, context, left = find_command(group, words)
        names = {word.partition("=")[0] for word in left if re.match(r"--|-[a-zA-Z]", word)}
        unknown = names - options_of(command)
        if unknown:
            return f"no option {', '.join(sorted(unknown))}"
        if isinstance(command, click.Group) or (not is_block and any(map(PLACEHOLDER, left))):
            return None
        command.make_context(context.info_name, left, parent=context.parent).close()
    except click.exceptions.Exit:
        return None
    except (click.MissingParameter, click.BadOptionUsage) as error:
        return error.format_message() if is_block else None
    except click.UsageError as error:
        return error.format_message()
    return None


def any_path(_type, value, _param, _ctx):
    """Return a path that need not exist: what stands in for `click.Path.convert`."""
    return Path(value) if value != "-" else value
