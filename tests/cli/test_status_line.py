"""The status line of a watch."""

import io
import os
import pty
import subprocess
from dataclasses import replace

import pytest

from zfcal.online.watch_events import StageStatus, Status
from zfcal_cli.status_line import StatusLine, describe

AT_WORK = Status(
    stages={
        "analyse": StageStatus(last_s=300),
        "calibrate": StageStatus(last_s=240, now_s=300, done=34, total=50),
    },
    score=0.8464,
    ceiling=0.9121,
    lag_s=51.2,
    n_skipped=1,
)


def test_it_says_what_each_stage_is_at():
    """Stage, window, S against its ceiling, lag and skipped windows."""
    assert describe(AT_WORK) == (
        "analyse: done to 300 s · calibrate: to 300 s 34/50 · S 0.846 of 0.912 · lag 51 s · "
        "skipped 1"
    )


def test_it_says_by_which_rule_the_last_model_was_published():
    """In two words, beside its score."""
    said = describe(replace(AT_WORK, rule="likelihood"))
    assert "S 0.846 of 0.912 by likelihood · lag 51 s" in said


def test_it_says_what_is_amiss():
    """A stage that fails, one that waits, a trial that is gone."""
    stages = {"analyse": StageStatus(problem="The disk is full."), "calibrate": StageStatus()}
    assert describe(Status(stages=stages)) == "analyse: fails, tries again · calibrate: waits"
    assert describe(Status(stages={}, is_gone=True)) == "the trial is gone; waits"


def test_nothing_is_drawn_without_a_terminal(capsys):
    """Nor wiped."""
    line = StatusLine(shown=False)
    line.show(describe(AT_WORK))
    line.clear()
    assert capsys.readouterr() == ("", "")


@pytest.mark.slow
def test_on_a_terminal_it_is_drawn_and_wiped(command, trial, watching):
    """The lines of the log stand above it; standard output stays paths alone."""
    ours, theirs = pty.openpty()
    environment = os.environ | {"COLUMNS": "160", "TERM": "xterm"}
    environment.pop("NO_COLOR", None)
    words = [*command, "watch", "trial", "--once", *watching.quick]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=theirs, text=True, env=environment
    ) as process:
        os.close(theirs)
        drawn = io.BytesIO()
        while True:
            try:
                drawn.write(os.read(ours, 4096))
            except OSError:
                break
        out = process.stdout.read()
    os.close(ours)
    text = drawn.getvalue().decode()
    assert process.returncode == 0, text
    assert "analyse: waits · calibrate: waits" in text
    assert "calibrate: window to 120 s in" in text
    assert "\x1b[2K" in text
    assert "\x1b" not in out
    assert out.split()[0] == "trial/stats/000120.parquet"
