"""`zfcal watch --view`: the address, what ends it, and what cannot be; and the table."""

import io
import signal
import socket
import subprocess
import time
import urllib.request

import pytest
from rich.console import Console

from zfcal.artifacts.validation import check
from zfcal.online.watch_events import Happened, StageStatus, Status
from zfcal_cli.watch_table import WatchTable


def read(url):
    """Return the code and the text of an answer."""
    with urllib.request.urlopen(url, timeout=60) as answer:  # noqa: S310 - on loopback
        return answer.status, answer.read().decode()


@pytest.mark.slow
def test_the_page_of_a_trial_that_nobody_writes_stays_until_ctrl_c(watching, trial):
    """Without stages nothing is made; the address stands in the events, and Ctrl-C is no fault."""
    before = {path for path in trial.rglob("*") if not path.name.startswith(".")}
    with watching.start(trial, "--view", "--view-port", "0", "--stages", "none") as watch:
        told = watch.until("page")
        check(told, "watch-event", "a line")
        code, text = read(told["url"])
        assert (code, "main.js" in text) == (200, True)
        began_s = time.monotonic()
        assert watch.end(signal.SIGINT) == 0
        assert time.monotonic() - began_s < 5
    assert {path for path in trial.rglob("*") if not path.name.startswith(".")} == before


@pytest.mark.slow
def test_a_watch_shows_its_stages_and_ends_with_an_open_page(watching, trial):
    """The page hears of failures and states; SIGTERM ends all."""
    with watching.start(trial, "--view", "--view-port", "0", "--stages", "analyse") as watch:
        url = watch.until("page")["url"]
        watch.until("made")
        with urllib.request.urlopen(url + "events", timeout=60) as answer:  # noqa: S310 - on loopback
            kinds = set()
            while "watch" not in kinds:
                line = answer.readline().decode()
                kinds |= {line[7:].strip()} if line.startswith("event: ") else set()
            assert watch.end(signal.SIGTERM) in {0, 143}
            assert b"event: bye" in answer.read()


@pytest.mark.slow
def test_once_leaves_and_takes_the_page_along(zfcal, trial):
    """Who asks to leave is not kept by the page."""
    done = zfcal("watch", trial, "--once", "--view", "--view-port", "0", "--stages", "analyse")
    assert done.code == 0
    assert "watch: a page for browsers on this computer is at http://127.0.0.1:" in done.err


def test_a_port_in_use_is_one_error_and_nothing_begins(zfcal, trial):
    """Before any stage."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = zfcal("watch", trial, "--view", "--view-port", port)
    assert done.code == 1
    assert done.err.splitlines() == [
        f"zfcal: error: --view-port: port {port} of 127.0.0.1 is in use.",
        "hint: Another page may be open there. Choose another port, or 0 for any.",
    ]
    assert not (trial / "stats").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--view-port", "1"], "--view-port belongs to --view."),
        (["--stages", "none"], "--stages none does nothing but show the page: add --view."),
        (["--stages", "none", "--view", "--once"], "--once is about stages"),
        (["--stages", "none", "--view", "--until-idle", "1s"], "--until-idle is about stages"),
        (["--stages", "none", "--view", "--seed", "1"], "none of the stages that run here"),
        (["--stages", "none,track", "--view"], "'none' is none of track"),
        (["--table"], "--table is drawn on a terminal, and standard error is not one."),
        (["--view", "--view-port", "70000"], "70000 is not in the range"),
    ],
)
def test_what_could_not_take_effect_is_wrong_usage(zfcal, trial, words, says):
    """Each with its reason."""
    done = zfcal("watch", trial, *words)
    assert done.code == 2
    assert says in done.err


def test_no_trial_is_one_error(zfcal, tmp_path):
    """As without the page."""
    done = zfcal("watch", tmp_path, "--view", "--view-port", "0", "--stages", "none")
    assert done.code == 1
    assert "trial.toml" in done.err


def drawn(table, status):
    """Return a table as a terminal of 100 columns shows it."""
    console = Console(file=io.StringIO(), width=100)
    console.print(table.draw(status))
    return console.file.getvalue()


def result(end_s, score, ceiling):
    """Return what a watch tells of a round."""
    value = {"window_end_s": end_s, "S": score, "ceiling": ceiling, "rule": "nearest"}
    return Happened(at_s=1.0, kind="result", stage="calibrate", values={"value": value})


def test_the_table_has_stages_rounds_and_what_is_amiss():
    """The last five rounds; a problem goes when a round is finished."""
    table = WatchTable()
    for n in range(6):
        table.take(result(120 + 60 * n, 0.7 + 0.01 * n, 0.9))
    table.take(
        Happened(at_s=1.0, kind="failed", stage="calibrate", values={"problem": "Disk full."})
    )
    stages = {
        "analyse": StageStatus(last_s=420),
        "calibrate": StageStatus(last_s=360, now_s=420, done=25, total=50),
    }
    status = Status(stages=stages, lag_s=51.2, n_skipped=1)
    text = drawn(table, status)
    rows = [" ".join(line.split()) for line in text.splitlines()]
    assert "analyse waits 7:00" in rows
    assert "calibrate window to 7:00 ━━━━━━━━╌╌╌╌╌╌╌╌ 25/50 6:00" in rows
    assert "S to 7:00 0.750 of 0.900 ████████████ nearest" in rows
    assert "S to 2:00" not in text
    assert "lag 51 s · skipped 1 · calibrate: Disk full." in text
    table.take(Happened(at_s=2.0, kind="finished", stage="calibrate"))
    assert "Disk full" not in drawn(table, status)


@pytest.mark.slow
def test_on_a_terminal_the_table_is_drawn(command, trial, tmp_path):
    """In the place of the status line."""
    script = [
        "script",
        "-qec",
        " ".join([*command, "watch", "trial", "--once", "--table", "--stages", "analyse"]),
        "/dev/null",
    ]
    done = subprocess.run(
        script, capture_output=True, text=True, cwd=tmp_path, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout
    assert "done to" in done.stdout
    assert "analyse" in done.stdout
