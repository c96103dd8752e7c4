"""What goes to stdout and what to stderr."""

import json
import os
from pathlib import Path

import pytest

from zfcal.errors import InputError, LockedError, OptionError
from zfcal.stages.events import LeftOut, Made, Note, Planned, Progress, Result, UpToDate
from zfcal_cli.output import Output


@pytest.fixture
def speak(capsys):
    """Return what lets an Output tell events, and returns both streams and the exit code."""

    def call(*events, **options):
        given = {"as_json": False, "verbose": 0, "quiet": False} | options
        with Output("analyse", **given) as out:
            for event in events:
                out.tell(event) if not callable(event) else out.attempt(event)
        captured = capsys.readouterr()
        return captured.out, captured.err, out.exit_code

    return call


def fail_with(error):
    """Return work that ends in an error."""

    def work():
        raise error

    return work


A, B = Path("t/stats/000120.parquet"), Path("t/stats/000180.parquet")


def test_paths_go_to_stdout_and_talk_to_stderr(speak):
    """Made or found up to date, one a line."""
    out, err, code = speak(Made(path=A, reason="missing"), UpToDate(path=B), Note(text="look"))
    assert out == f"{A}\n{B}\n"
    assert err == "look\nanalyse: 1 made, 1 up to date.\n"
    assert code == 0


def test_a_path_appears_once_however_often_it_is_met(speak):
    """Unless it is made again."""
    out, _, _ = speak(UpToDate(path=A), UpToDate(path=A), Made(path=B, reason=""), UpToDate(path=B))
    assert out == f"{A}\n{B}\n"
    out, _, _ = speak(UpToDate(path=A), Made(path=A, reason="changed"))
    assert out == f"{A}\n{A}\n"


def test_the_second_run_says_that_it_did_nothing(speak):
    """So that nobody wonders."""
    assert speak(UpToDate(path=A))[1] == "analyse: nothing to do, 1 up to date.\n"


def test_what_is_planned_is_talk(speak):
    """It is no artifact, so a pipe must not take it for one."""
    out, err, _ = speak(Planned(path=A, reason="missing"))
    assert out == ""
    assert err.splitlines()[0] == f"would make {A}: missing"


def test_a_damaged_input_is_named_once_and_ends_with_3(speak):
    """What follows from it is named as well."""
    problem = LeftOut(path=A, problem=f"{A}: was cut short.", hint="Copy it again.")
    out, err, code = speak(problem, problem, Made(path=B, reason="missing"))
    assert (out, code) == (f"{B}\n", 3)
    assert err.count("was cut short") == 1
    assert "hint: Copy it again." in err


def test_names_of_files_do_not_steer_the_terminal(speak):
    """Errors, hints, warnings and what is left out show such signs as letters."""
    name = "a\x1b[31m\x9b\x00\tb"
    told = (
        LeftOut(path=A, problem=name, hint=name),
        Note(text=name, warning=True),
        Planned(path=Path(name), reason="missing"),
        fail_with(InputError(name, hint=name)),
    )
    err = speak(*told)[1]
    assert err.count("a\\x1b[31m\\x9b\\x00\tb") == 6
    assert "\x1b" not in err


def test_what_is_left_out_without_damage_ends_with_0(speak):
    """A minute without fish is no damage."""
    assert speak(LeftOut(path=A, problem="no fish", damaged=False))[2] == 0


def test_of_several_errors_the_worst_counts(speak):
    """An error comes before a lock, a lock before damage."""
    damage = LeftOut(path=A, problem="cut")
    locked, wrong = fail_with(LockedError("busy")), fail_with(InputError("wrong"))
    assert speak(damage, locked)[2] == 75
    assert speak(locked, damage)[2] == 75
    assert speak(damage, wrong, locked)[2] == 1


def test_options_that_cannot_be_end_the_command():
    """They are wrong for every trial: the next one is not tried."""

    def work():
        raise OptionError("--window is none.")

    with pytest.raises(OptionError, match="--window"):
        Output("test", as_json=False, verbose=0, quiet=False).attempt(work)


def test_the_same_error_is_said_once(speak):
    """A pipe meets it with every line."""
    busy = fail_with(LockedError("busy", hint="wait"))
    assert speak(busy, busy)[1] == "zfcal: error: busy\nhint: wait\n"


def test_json_is_one_document_with_everything(speak):
    """And no path beside it."""
    out, err, _ = speak(
        Made(path=A, reason="missing"),
        UpToDate(path=B),
        LeftOut(path=B, problem="cut"),
        Note(text="look", warning=True),
        Result(value={"S": 0.5}),
        fail_with(InputError("wrong", hint="mend")),
        as_json=True,
    )
    assert json.loads(out) == {
        "command": "analyse",
        "exit_code": 1,
        "artifacts": [
            {"path": str(A), "state": "made", "reason": "missing"},
            {"path": str(B), "state": "up to date", "reason": ""},
        ],
        "left_out": [{"path": str(B), "problem": "cut"}],
        "messages": [{"level": "warning", "text": "look"}],
        "errors": [{"message": "wrong", "hint": "mend"}],
        "results": [{"S": 0.5}],
    }
    assert "wrong" in err


def test_an_interrupt_still_leaves_a_document(capsys):
    """With the exit code that the process has, and a word for people."""
    with pytest.raises(KeyboardInterrupt), Output("a", as_json=True, verbose=0, quiet=False):
        raise KeyboardInterrupt
    document = json.loads(capsys.readouterr().out)
    assert document["exit_code"] == 130
    assert document["errors"] == [{"message": "Interrupted.", "hint": ""}]


def test_quiet_leaves_errors_and_what_is_left_out(speak):
    """Notes, sums and bars go."""
    _, err, _ = speak(
        Note(text="look"),
        Made(path=A, reason=""),
        LeftOut(path=B, problem="cut"),
        fail_with(InputError("wrong")),
        quiet=True,
    )
    assert err == "zfcal: left out: cut\nzfcal: error: wrong\n"


def test_verbose_says_why(speak):
    """A line per artifact."""
    _, err, _ = speak(Made(path=A, reason="option runs: 1 -> 2"), verbose=1)
    assert f"{A}: made (option runs: 1 -> 2)\n" in err


def test_without_a_terminal_there_is_no_bar_and_no_colour(speak):
    """Nothing but text for a log."""
    _, err, _ = speak(Progress(stage="analyse", done=1, total=3), Note(text="x", warning=True))
    assert "\x1b" not in err
    assert err == "warning: x\n"


@pytest.mark.parametrize(("no_color", "coloured"), [("", True), ("1", False)])
def test_a_terminal_gets_colour_unless_no_color_is_set(monkeypatch, capsys, no_color, coloured):
    """https://no-color.org: any value that is not empty."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("NO_COLOR", no_color)
    monkeypatch.setattr("click._compat.should_strip_ansi", lambda *_: False)
    monkeypatch.setattr("click.utils.should_strip_ansi", lambda *_: False)
    from zfcal_cli.output import complain

    complain("wrong")
    assert ("\x1b[" in capsys.readouterr().err) == coloured


def test_a_path_that_is_no_utf_8_still_gives_valid_json(capfdbinary):
    """The document parses; the byte that is none is replaced."""
    with Output("analyse", as_json=True, verbose=0, quiet=True) as out:
        out.left_out(Path(os.fsdecode(b"\xff.parquet")), "odd")
    document = json.loads(capfdbinary.readouterr().out.decode())
    assert document["left_out"][0]["path"] == "\ufffd.parquet"
