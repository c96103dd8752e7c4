"""The `zfcal` command: finds the subcommand, and turns errors into text once.

Subcommands are imported when they are asked for, and they import what is heavy
when they run: `zfcal --help` loads neither numpy nor pandas.
"""

from __future__ import annotations

import difflib
import errno
import gc
import importlib
import io
import itertools
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import NoReturn

import click
from click.shell_completion import get_completion_class

from .options import PathName, laid_out
from .output import (
    EXIT_INTERRUPTED,
    HAS_VOICE,
    Output,
    ReaderGoneError,
    complain,
    usage_text,
)

COMMANDS = {
    "demo": "demo",
    "init": "init",
    "camera": "camera",
    "import": "import_",
    "simulate": "simulate",
    "track": "track",
    "analyse": "analyse",
    "calibrate": "calibrate",
    "drive": "drive",
    "watch": "watch",
    "diagnose": "diagnose",
    "extend": "extend",
    "compare": "compare",
    "report": "report",
    "reproduce": "reproduce",
    "export": "export",
    "inspect": "inspect",
    "check": "check",
}
"""Each command and the module that holds it, in the order of a day's work."""

TASKS = {
    "A first look": ("demo",),
    "A trial and its tracks": ("init", "camera", "import", "track", "simulate"),
    "Fish and their model": ("analyse", "calibrate", "diagnose", "extend"),
    "The robot": ("drive", "watch"),
    "Results": ("report", "compare", "reproduce", "export"),
    "Files": ("inspect", "check"),
}
"""What people come to do, and the commands for it, as `zfcal --help` lists them."""

_WHOLE_SENTENCE = 300
"""Longer than the first sentence of any command's help, in characters."""

_AS_JSON = f"{__name__}.as_json"
"""Key of --json in what click keeps while it reads the options."""

_EXIT_USAGE = 2
_EXIT_READER_GONE = 141
_STREAM_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}
_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""What says how many threads a product of matrices takes; read when numpy is loaded."""

_OBJECTS = 50_000
"""New objects after which Python looks for those that refer to each other and to nothing else."""

_LINUX_MODULES = {"fcntl", "termios", "tty"}
"""What drives a robot needs them."""

_BUG_HINT = "Run it again with --traceback to see where, and report it."


class Terminated(BaseException):
    """SIGTERM came; like `KeyboardInterrupt`, nothing but the top catches it."""

    exit_code = 143


class _LazyGroup(click.Group):
    """A group that imports a subcommand when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names, in the order of `COMMANDS`."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Return a command; None if there is none of that name."""
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f".{COMMANDS[cmd_name]}", __package__)
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands by task, each with the first sentence of its help."""
        widest = max(map(len, COMMANDS))
        for task, names in TASKS.items():
            found = [(name, self.get_command(ctx, name)) for name in names]
            rows = [
                (name.ljust(widest), command.get_short_help_str(_WHOLE_SENTENCE))
                for name, command in found
                if command is not None
            ]
            with formatter.section(task):
                formatter.write_dl(rows)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that is meant, or say which one may be."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            near = difflib.get_close_matches(args[0], COMMANDS, n=1)
            meant = f" Did you mean {near[0]!r}?" if near else ""
            raise click.UsageError(f"No command {args[0]!r}.{meant}", ctx)
        return super().resolve_command(ctx, args)


def _print_version(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        from .version import about, version_text

        click.echo(about() if ctx.meta.get(_AS_JSON) else version_text())
        ctx.exit()


def _note_json(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    ctx.meta[_AS_JSON] = value


def _write_manual(ctx: click.Context, _: click.Parameter, folder: Path | None) -> None:
    if folder is not None and not ctx.resilient_parsing:
        from .manual import write_pages
        from .version import number

        for path in write_pages(group, folder, TASKS, number()):
            click.echo(str(path))
        ctx.exit()


def _compile(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        from zfcal.virtual.compiling import compile_all

        click.echo("Compiling takes about a minute on two cores, the first time.", err=True)
        click.echo(str(compile_all()))
        ctx.exit()


def _print_completion(ctx: click.Context, _: click.Parameter, shell: str | None) -> None:
    if shell and not ctx.resilient_parsing:
        made = get_completion_class(shell)
        if made is None:
            raise click.UsageError(f"no completion for {shell!r}")
        click.echo(made(group, {}, "zfcal", "_ZFCAL_COMPLETE").source())
        ctx.exit()


@click.group(cls=_LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    # Not eager: --json is taken first, wherever it stands.
    callback=_print_version,
    help="Show the version and leave.",
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    is_eager=True,
    callback=_note_json,
    help="With --version: also Python, libraries and threads, for a bug report.",
)
@click.option(
    "--completion",
    type=click.Choice(["bash", "zsh", "fish"]),
    expose_value=False,
    is_eager=True,
    callback=_print_completion,
    help="Print the completion script of a shell and leave.",
)
@click.option(
    "--man",
    metavar="DIR",
    type=PathName(file_okay=False),
    expose_value=False,
    is_eager=True,
    callback=_write_manual,
    help="Write the manual pages into a folder and leave.",
)
@click.option(
    "--compile",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_compile,
    help="Compile simulator and tracker for this computer and leave; no command waits for it then.",
)
@click.pass_context
@laid_out
def group(ctx: click.Context, as_json: bool) -> None:  # noqa: ARG001 - it is in ctx.meta
    r"""Analyse and calibrate: a robot among zebrafish.

    Every command reads files of a trial directory and writes files into it.
    It makes what is missing or stale, and nothing else. The paths of the files
    go to standard output, one a line; a command given - instead of a trial
    reads such paths, so commands are joined with a pipe.

    \b
    Example:
        zfcal init trial --arena two-rooms --fish 4 --robot --fps 15
        zfcal import tracks.csv trial --format csv | zfcal analyse - | zfcal calibrate -
        eval "$(zfcal --completion bash)"
        zfcal --man ~/.local/share/man/man1
        zfcal --compile
    """
    if ctx.meta[_AS_JSON]:
        command = ctx.invoked_subcommand
        raise click.UsageError(
            f"--json stands behind the command, or with --version: zfcal {command} ... --json"
        )


def main() -> NoReturn:
    """Run the command line and leave with its exit code."""
    if "OMP_NUM_THREADS" not in os.environ:
        for name in _BLAS_THREADS:
            # Commands have threads of their own. Those of a library, which wait in a loop for
            # the next product of small matrices, take the processor from them: a diagnosis took
            # twice as long.
            os.environ.setdefault(name, "1")
    # Libraries leave some 100,000 objects for good, which would be looked through again and again.
    gc.set_threshold(_OBJECTS, 5, 5)
    sys.exit(run(sys.argv[1:]))


def run(argv: Sequence[str]) -> int:
    """Return the exit code of a command line.

    Parameters
    ----------
    argv
        What follows ``zfcal``.

    Returns
    -------
    int
        As `docs/commands.md` lists them.
    """
    signal.signal(signal.SIGTERM, _terminate)
    _open_streams()
    try:
        code = _obey(argv)
        sys.stdout.flush()
    except (KeyboardInterrupt, click.Abort):
        return EXIT_INTERRUPTED
    except Terminated as error:
        return error.exit_code
    except (BrokenPipeError, ReaderGoneError):
        return _reader_gone()
    except Exception as error:  # noqa: BLE001 - the one place where what escaped becomes text
        return _explain(error, argv)
    return code


def _obey(argv: Sequence[str]) -> int:
    """Run the command; wrong usage is explained within what a reader may leave at any time."""
    try:
        code = group.main(args=list(argv), prog_name="zfcal", standalone_mode=False)
    except click.UsageError as error:
        return _explain_usage(error, argv)
    return code if isinstance(code, int) else 0


def _open_streams() -> None:
    """Put the null device where a standard stream was closed (``<&-``): Python has None there.

    On Windows they are UTF-8, as files are: a page of its own has no place for some of our signs.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if os.name == "nt" and isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8")
        if stream is None:
            # It lives as long as the process.
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115


def _terminate(number: int, frame: FrameType | None) -> NoReturn:  # noqa: ARG001 - the signal's signature
    raise Terminated("Ended by SIGTERM.")


def _reader_gone() -> int:
    """Leave quietly when nobody reads standard output any more."""
    _drop_output()
    return _EXIT_READER_GONE


def _drop_output() -> None:
    """Send what is still buffered nowhere: closing the stream would raise once more."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _explain_usage(error: click.UsageError, argv: Sequence[str]) -> int:
    error.ctx = error.ctx or _context_of(argv)
    message, hint = usage_text(error)
    complain(message, hint=hint)
    # What stands behind -- is no option.
    as_json = "--json" in itertools.takewhile(lambda word: word != "--", argv)
    if as_json and not error.ctx.meta.get(HAS_VOICE):
        out = Output(error.ctx.info_name or "", as_json=True, verbose=0, quiet=True)
        # One line is a document, and a line among those of `watch` as well.
        out.in_lines = True
        out.record(error)
        out.print_document()
    return _EXIT_USAGE


def _context_of(argv: Sequence[str]) -> click.Context:
    """Return the context of the command that is named: click has none for some mistakes."""
    context = click.Context(group, info_name="zfcal")
    for word in argv:
        if not isinstance(context.command, click.Group):
            break
        command = context.command.get_command(context, word)
        if command is None:
            break
        context = click.Context(command, parent=context, info_name=word)
    return context


def _explain(error: Exception, argv: Sequence[str]) -> int:
    from zfcal.errors import ZfcalError

    if isinstance(error, ZfcalError):
        complain(str(error), hint=error.hint)
        return error.exit_code
    if "--traceback" in argv or "-vv" in argv:
        traceback.print_exception(error)
    if isinstance(error, ModuleNotFoundError) and error.name in _LINUX_MODULES:
        complain(
            f"this runs on Linux alone: there is no module {error.name} on this system.",
            hint="See docs/platforms.md for what runs where.",
        )
    elif isinstance(error, OSError) and error.filename is not None:
        complain(f"{error.filename}: {error.strerror or error}.")
    elif isinstance(error, OSError) and error.errno in _STREAM_FULL:
        complain(
            f"standard output: cannot be written ({error.strerror}).",
            hint="The files of the trial are whole; the same command again lists their paths.",
        )
        _drop_output()
    else:
        complain(f"a bug in zfcal: {type(error).__name__}: {error}", hint=_BUG_HINT)
    return 1


if __name__ == "__main__":
    main()
