"""The group: help, completion, and how errors and signals end."""

import io
import json
import os
import re
import signal
import subprocess
import sys

import click
import pytest

from zfcal.errors import DamagedError, InputError, LockedError, StorageError, ZfcalError
from zfcal_cli import main as main_module
from zfcal_cli.main import COMMANDS, TASKS, group, run
from zfcal_cli.output import Output


def all_commands():
    """Return every command by its name."""
    context = click.Context(group)
    return {name: group.get_command(context, name) for name in group.list_commands(context)}


def every_part(name):
    """Return a command, or those of a group, by the words that call them."""
    found = all_commands()[name]
    if not isinstance(found, click.Group):
        return {name: found}
    return {f"{name} {part}": command for part, command in found.commands.items()}


def test_help_lists_every_command_below_its_task(zfcal):
    """Each once, below the heading of its task, and with a whole sentence."""
    done = zfcal("--help")
    assert sorted(name for names in TASKS.values() for name in names) == sorted(COMMANDS)
    for task, names in TASKS.items():
        part = done.out.partition(f"\n{task}:\n")[2].partition("\n\n")[0]
        rows = re.findall(r"^  (\S+)  .*$", part, flags=re.MULTILINE)
        assert rows == list(names)
        sentences = re.split(r"^  \S+", part, flags=re.MULTILINE)[1:]
        assert all(text.rstrip().endswith(".") and "..." not in text for text in sentences)
    assert done.code == 0


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_with_an_example(zfcal, name):
    """The example is kept line by line, and calls that command."""
    done = zfcal(name, "--help")
    example = done.out.partition("Example:\n")[2].partition("\n\n")[0]
    assert f"zfcal {name}" in example
    assert all(line.startswith("      ") for line in example.splitlines())
    assert done.code == 0


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_says_what_it_does(name):
    """No option without a help text."""
    for part in every_part(name).values():
        for parameter in part.params:
            if isinstance(parameter, click.Option):
                assert parameter.help, parameter.name


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_speaks_json_and_keeps_quiet(name):
    """The options that are the same everywhere are there everywhere."""
    for words, part in every_part(name).items():
        options = {word for parameter in part.params for word in parameter.opts}
        assert {"--json", "--verbose", "--quiet", "--traceback"} <= options, words


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_stands_in_the_documentation(repository, name):
    """docs/commands.md has its usage, and every long option that is not everywhere."""
    text = (repository / "docs" / "commands.md").read_text(encoding="utf-8")
    section = text.partition(f"\n## zfcal {name}")[2].partition("\n## ")[0]
    assert section, f"no section on zfcal {name}"
    common = {"--json", "--verbose", "--quiet", "--traceback"}
    for words, part in every_part(name).items():
        assert f"zfcal {words}" in section, words
        for parameter in (each for each in part.params if not getattr(each, "hidden", False)):
            for word in set(parameter.opts) - common:
                if word.startswith("--"):
                    assert f"`{word}" in section, f"{words} {word}"


@pytest.mark.parametrize("name", [name for name in COMMANDS if name not in {"demo", "camera"}])
def test_a_command_without_words_is_wrong_usage(zfcal, name):
    """It says what is missing."""
    done = zfcal(name)
    assert done.code == 2
    assert "issing" in done.err or "needs" in done.err or "Give" in done.err


@pytest.mark.parametrize("name", ["watch", "analyse", "drive"])
def test_help_says_what_json_is(zfcal, name):
    """Of a watch a line for each event, of all others one document."""
    said = " ".join(zfcal(name, "--help").out.split())
    assert ("--json A line of JSON for each event" in said) == (name == "watch")
    assert ("--json One JSON document" in said) == (name != "watch")


def test_help_loads_nothing_heavy():
    """numpy, pandas and the like stay out: what makes a start slow is loaded by commands."""
    code = (
        "import sys; from zfcal_cli.main import run; run(['--help']);"
        "print([m for m in ('numpy', 'pandas', 'pyarrow', 'numba', 'scipy', 'shapely', 'rich') "
        "if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_the_version_is_the_package_s(zfcal):
    """As the metadata says."""
    assert zfcal("--version").out.startswith("zfcal 0.")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_scripts_can_be_printed(zfcal, shell):
    """To be evaluated by the shell."""
    assert "_ZFCAL_COMPLETE" in zfcal("--completion", shell).out


def test_commands_are_completed(process):
    """What bash asks for after `zfcal an`."""
    words = {"_ZFCAL_COMPLETE": "bash_complete", "COMP_WORDS": "zfcal an", "COMP_CWORD": "1"}
    assert "analyse" in process(env=words).out


def test_a_mistyped_command_is_guessed(zfcal):
    """Wrong usage ends with 2, in two lines and without a traceback."""
    done = zfcal("analyze", "trial")
    assert done.code == 2
    assert done.err.splitlines() == [
        "zfcal: error: No command 'analyze'. Did you mean 'analyse'?",
        "hint: See: zfcal --help",
    ]


@pytest.mark.parametrize(
    "words",
    [
        ["analyse"],
        ["analyse", "t", "--nonsense"],
        ["analyse", "t", "-q", "-v"],
        ["analyse", "-", "t"],
        ["calibrate", "t", "--budget", "soon"],
        ["calibrate", "t", "--budget", "5s", "--generations", "3"],
        ["calibrate", "t", "--window", "900:0", "-o", "m.toml"],
        ["calibrate", "t", "--window", "0:900"],
        ["calibrate", "t", "--held-out", "0:900"],
        ["calibrate", "t", "-o", "m.toml"],
        ["calibrate", "-", "--window", "0:900", "-o", "m.toml"],
        ["init", "t", "--arena", "two-rooms"],
        ["init", "t", "--arena", "two-rooms", "--fish", "3", "--robot", "--robots", "2"],
        ["simulate", "t", "--duration", "60"],
        ["simulate", "t", "--model", "nowhere.toml", "--duration", "60"],
        ["import", "nowhere.csv", "t"],
        ["inspect", "nowhere.parquet"],
    ],
)
def test_wrong_usage_ends_with_2_and_names_the_help(zfcal, words):
    """Of the command that was called; nothing is written."""
    done = zfcal(*words)
    assert done.code == 2
    assert done.out == ""
    assert done.err.splitlines()[-1] == f"hint: See: zfcal {words[0]} --help"


@pytest.mark.parametrize(("words", "command", "message"), [
    (("analyse", "--json"), "analyse", "Missing argument 'TRIAL...'."),
    (("analyse", "trial", "--bogus", "--json"), "analyse", "No such option '--bogus'."),
    (("analyse", "trial", "--json", "-q", "-v"), "analyse", "--quiet and --verbose contradict"),
    (("export", "trial", "--json"), "export", "There is nothing to export"),
    (("watch", "trial", "--bogus", "--json"), "watch", "No such option '--bogus'."),
    (("camera", "corners", "1,2", "3,4", "--json"), "corners", "Argument 'corners' takes 4 values"),
    (("anlyse", "--json"), "zfcal", "No command 'anlyse'."),
])  # fmt: skip
def test_wrong_usage_with_json_is_one_document_as_well(zfcal, words, command, message):
    """Said on standard error as ever, whoever finds it."""
    done = zfcal(*words)
    document = json.loads(done.out)
    (error,) = document["errors"]
    assert (done.code, document["exit_code"], document["command"]) == (2, 2, command)
    assert error["message"].startswith(message)
    path = {"corners": "zfcal camera corners", "zfcal": "zfcal"}.get(command, f"zfcal {command}")
    assert error["hint"] == f"See: {path} --help"
    assert done.err == f"zfcal: error: {error['message']}\nhint: {error['hint']}\n"


def test_what_stands_behind_two_dashes_asks_for_no_document(zfcal):
    """A trial may be called --json."""
    assert zfcal("analyse", "--bogus", "--", "--json").out == ""


def test_wrong_usage_of_a_command_that_writes_lines_is_one(zfcal):
    """Readers of `watch --json` take a document from each line."""
    out = zfcal("watch", "trial", "--bogus", "--json").out
    assert len(out.splitlines()) == 1
    assert json.loads(out)["errors"][0]["message"].startswith("No such option '--bogus'.")


@pytest.mark.parametrize("number", ["nan", "inf", "-1"])
@pytest.mark.parametrize(
    "words",
    [
        ["diagnose", "t", "--quick", "--noise-mm"],
        ["drive", "t", "--port", "virtual", "--radius-mm"],
        ["init", "t", "--fish", "3", "--side-m"],
        ["init", "t", "--fish", "3", "--fps"],
        ["import", "t.csv", "t", "--mm-per-px"],
        ["demo", "t", "--closed-loop", "--drift-s"],
    ],
)
def test_what_is_no_finite_number_is_wrong_usage(zfcal, words, number):
    """NaN passes every comparison: it would fail far from where it was typed."""
    done = zfcal(*words, number)
    assert done.code == 2
    assert words[-1] in done.err
    assert ("no finite number" in done.err) == (number != "-1")


@pytest.mark.parametrize("command", ["calibrate", "extend", "watch"])
@pytest.mark.parametrize(("number", "hint"), [("7", "take 4 or 8"), ("0", "x>=4"), ("-4", "x>=4")])
def test_a_population_of_no_fours_is_wrong_usage(zfcal, command, number, hint):
    """It is said before a trial is opened, with what would do."""
    done = zfcal(command, "t", "--population", number)
    assert done.code == 2
    assert hint in done.err


@pytest.mark.parametrize("option", ["--runs", "--steps"])
def test_a_search_without_steps_is_wrong_usage(zfcal, option):
    """None at all cannot be compared with anything."""
    done = zfcal("calibrate", "t", option, "0")
    assert done.code == 2
    assert "x>=1" in done.err


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (ZfcalError("wrong", hint="mend it"), 1),
        (InputError("wrong", hint="mend it"), 1),
        (DamagedError("wrong", hint="mend it"), 3),
        (StorageError("wrong", hint="mend it"), 1),
        (LockedError("wrong", hint="mend it"), 75),
        (KeyboardInterrupt(), 130),
        (main_module.Terminated(), 143),
    ],
)
def test_each_error_has_its_exit_code(monkeypatch, capsys, error, code):
    """Ours are two lines: what, and what to do. Signals are silent."""

    def fail(**_):
        raise error

    monkeypatch.setattr(main_module.group, "main", fail)
    assert run([]) == code
    ours = isinstance(error, ZfcalError)
    assert capsys.readouterr().err == ("zfcal: error: wrong\nhint: mend it\n" if ours else "")


def test_a_bug_is_one_line_unless_its_trace_is_asked_for(monkeypatch, capsys):
    """A KeyError is nobody's input."""

    def fail(**_):
        raise KeyError("oops")

    monkeypatch.setattr(main_module.group, "main", fail)
    assert run([]) == 1
    said = capsys.readouterr().err
    assert said.startswith("zfcal: error: a bug in zfcal: KeyError: 'oops'\nhint: ")
    assert run(["--traceback"]) == 1
    assert "Traceback (most recent call last)" in capsys.readouterr().err


def test_a_file_that_may_not_be_read_is_no_bug(monkeypatch, capsys):
    """The operating system's own words, with the file."""

    def fail(**_):
        raise PermissionError(13, "Permission denied", "trial/trial.toml")

    monkeypatch.setattr(main_module.group, "main", fail)
    assert run([]) == 1
    assert capsys.readouterr().err == "zfcal: error: trial/trial.toml: Permission denied.\n"


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_a_waiting_command_quietly(command, trial, number, code):
    """It waits for paths that do not come; nothing but the exit code tells."""
    with subprocess.Popen(
        [*command, "analyse", "-"],
        cwd=trial.parent,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    ) as waiting:
        waiting.stdin.write(b"trial/tracks/000060.parquet\n")
        waiting.stdin.flush()
        # Its first line says that it is at work: the handlers are in place.
        assert waiting.stdout.readline() == b"trial/stats/000120.parquet\n"
        waiting.send_signal(number)
        assert waiting.wait(timeout=20) == code
        assert b"Traceback" not in waiting.stderr.read()


@pytest.mark.parametrize(("number", "says"), [
    (signal.SIGINT, "Interrupted."),
    (signal.SIGTERM, "Ended by SIGTERM."),
])  # fmt: skip
def test_a_signal_is_an_error_of_the_document(monkeypatch, capsys, number, says):
    """In words, whichever command it ends."""

    def wait(*_, **__):
        with Output("calibrate", as_json=True, verbose=0, quiet=False):
            signal.raise_signal(number)

    monkeypatch.setattr(main_module.group, "main", wait)
    code = run(["calibrate", "trial", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert document["exit_code"] == code == 128 + number
    assert document["errors"] == [{"message": says, "hint": ""}]


def test_a_reader_that_goes_away_ends_it_quietly(command, trial):
    """As `| head -1` does."""
    with subprocess.Popen(
        [*command, "analyse", "trial"],
        cwd=trial.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as writing:
        writing.stdout.close()
        assert writing.wait(timeout=60) == 141
        assert writing.stderr.read() == b""


@pytest.mark.parametrize(
    ("redirection", "code"), [("<&-", 0), (">&-", 0), ("2>&-", 0), (">/dev/full", 1)]
)
def test_a_stream_that_is_closed_or_full_is_no_bug(command, trial, redirection, code):
    """As under a daemon that closes them: the work is done, and a full one is named."""
    line = f"{' '.join(command)} analyse {'-' if redirection == '<&-' else 'trial'} {redirection}"
    done = subprocess.run(
        ["sh", "-c", line], cwd=trial.parent, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    assert "bug" not in done.stderr
    assert ("standard output: cannot be written" in done.stderr) == (code == 1)


@pytest.mark.parametrize(
    ("asked", "expected"),
    [({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2"), ({"OMP_NUM_THREADS": "2"}, "None")],
)
def test_libraries_have_one_thread_beside_those_of_a_command(asked, expected):
    """Unless someone asks for more; numpy reads it when it is loaded, so before that."""
    script = """if True:
        import os, sys
        from zfcal_cli.main import main
        assert "numpy" not in sys.modules
        sys.argv = ["zfcal", "inspect", "missing.json"]
        try:
            main()
        except SystemExit:
            print(os.environ.get("OPENBLAS_NUM_THREADS"))
    """
    own = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", script], env={**own, **asked}, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout.strip() == expected


def test_on_windows_the_standard_streams_are_utf_8(monkeypatch):
    """The page of a western Windows has no minus sign and no Greek."""
    printed = io.BytesIO()
    with monkeypatch.context() as windows:
        windows.setattr(os, "name", "nt")
        stream = io.TextIOWrapper(printed, encoding="cp1252")
        windows.setattr(sys, "stdout", stream)
        main_module._open_streams()
        stream.write("\u22121 \u03bc")
        stream.flush()

    assert printed.getvalue() == "\u22121 \u03bc".encode()
