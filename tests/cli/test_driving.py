"""How a driver speaks: its status line, its lines of JSON, and that nobody keeps it waiting."""

import json
import threading
import time
from pathlib import Path

import pytest

from zfcal.artifacts.validation import check
from zfcal.drive.events import DriveStatus, line_of
from zfcal.stages.events import Made, Note, Progress, Result
from zfcal_cli import driving
from zfcal_cli.driving import DriveVoice
from zfcal_cli.main import Terminated
from zfcal_cli.output import Output
from zfcal_cli.status_line import describe_drive

FAULT = Note(
    text="12.4 s: The port has gone.",
    warning=True,
    kind="fault",
    values={"time_s": 12.4, "fault": "port-lost", "ended": False},
)


def status(**changes):
    """Return a state."""
    known = {"time_s": 612.4, "total_s": None, "model": "models/000540.toml", "held": ""}
    return DriveStatus(**{**known, "steps_missed": 0, **changes})


def test_the_status_line_says_what_drives_and_how_quick_it_is():
    """Time, model, both latencies; where it is to end, what was missed, why it stands."""
    assert describe_drive(status()) == "drive: 612 s · models/000540.toml"
    assert describe_drive(
        status(pose_to_state_s=0.0071, tick_to_byte_s=0.0006, total_s=1800, steps_missed=2)
    ) == ("drive: 612 of 1800 s · models/000540.toml · pose 7 ms, tick 1 ms · missed 2")
    assert describe_drive(status(held="port-lost")).endswith(" · held: port-lost")
    assert describe_drive(status(time_s=None)) == "drive: waits for poses · models/000540.toml"


def test_what_happens_is_a_line_of_the_schema():
    """A fault by its name; what any stage tells, as a watch tells it; progress is none."""
    line = line_of(FAULT, 3.00049)
    assert line["event"] == "fault"
    assert (line["at_s"], line["fault"], line["ended"]) == (3.0, "port-lost", False)
    for event in (
        FAULT,
        Note(text="Nobody answers.", warning=True),
        Made(path=Path("trial/drive/000000.mcap"), reason="driven"),
        Result(value={"commands": 5}),
    ):
        check(line_of(event, 0.0), "drive-event", "a line")
    assert line_of(Progress(stage="replay", done=1, total=2), 0.0) is None


def voice(*, events=True):
    """Return a voice that writes lines of events, or paths."""
    out = Output("drive", as_json=False, verbose=0, quiet=False)
    return DriveVoice(out, events=events)


def lines_of(capsys):
    """Return the lines on standard output."""
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def test_lines_come_in_order_and_the_last_one_says_why_it_ended(capsys):
    """All of them are written before the command goes on."""
    with voice() as speaks:
        speaks.hear(FAULT)
        speaks.hear(status())
        speaks.because = "the duration is over"
    told = lines_of(capsys)
    assert [line["event"] for line in told] == ["fault", "ended"]
    assert told[1]["because"] == "the duration is over"


@pytest.mark.parametrize(
    ("error", "because"), [(KeyboardInterrupt(), "Ctrl-C"), (Terminated(), "SIGTERM")]
)
def test_an_end_by_a_signal_is_named(capsys, error, because):
    """And the signal goes on its way."""
    with pytest.raises(type(error)), voice():
        raise error
    assert lines_of(capsys)[0]["because"] == because


def test_without_events_talk_goes_to_standard_error_and_paths_to_the_other(capsys):
    """As every command does it."""
    with voice(events=False) as speaks:
        speaks.hear(FAULT)
        speaks.hear(Made(path=Path("trial/drive/000000.mcap"), reason="driven"))
        speaks.because = "the poses have ended"
    told = capsys.readouterr()
    assert told.out == "trial/drive/000000.mcap\n"
    assert "warning: 12.4 s: The port has gone." in told.err
    assert "drive: ends, the poses have ended." in told.err


def test_who_does_not_read_keeps_nobody_from_driving(monkeypatch, capsys):
    """A write that takes for ever is waited for by the voice alone."""
    reads = threading.Event()
    written = driving.click.echo
    monkeypatch.setattr(driving.click, "echo", lambda *a, **k: (reads.wait(30), written(*a, **k)))
    with voice() as speaks:
        began_s = time.monotonic()
        for _ in range(100):
            speaks.hear(FAULT)
        assert time.monotonic() - began_s < 1.0
        reads.set()
    assert len(lines_of(capsys)) == 101


def test_a_reader_that_has_gone_ends_the_drive(monkeypatch):
    """The error comes up where the driver tells something next."""

    def gone(*_, **__):
        raise BrokenPipeError

    monkeypatch.setattr(driving.click, "echo", gone)
    told = []

    def drive():
        with voice() as speaks:
            for number in range(100):
                speaks.hear(FAULT)
                told.append(number)
                time.sleep(0.01)

    with pytest.raises(BrokenPipeError):
        drive()
    assert len(told) < 100


@pytest.mark.parametrize("other", ["--json", "--replay", "--publish=cats2://rig"])
def test_events_are_for_driving_alone(zfcal, other):
    """Where they cannot be told, or a document is asked for, that is said."""
    outcome = zfcal(
        "drive", "trial", "--events", other, *(["--port", "virtual"] if other == "--json" else [])
    )
    assert outcome.code == 2
    assert "--events" in outcome.err
