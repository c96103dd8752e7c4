"""Rounds beside a virtual experiment: what they make, what they tell, how they end."""

import os
import shutil
import signal

import pytest

from zfcal.calibrate.task import Settings
from zfcal.errors import ZfcalError
from zfcal.online.worker import Worker
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.searching import CalibrateOptions
from zfcal.stages.events import Made, Result, say_nothing
from zfcal.stages.trial_context import open_trial
from zfcal.virtual.closed_loop import closed_loop
from zfcal.virtual.rounds import RoundsBeside, Windows, do_rounds, rounds_beside
from zfcal.virtual.trial import Experiment, LoopOptions

pytestmark = pytest.mark.slow

LITTLE = Settings(
    population=8, generations=1, steps=200, n_confirmed=2, long_runs=2, long_s=120.0, n_windows=10
)
MADE = ("stats", "scores", "models")


@pytest.fixture(scope="module")
def swum(tmp_path_factory):
    """Return the folder of three minutes in which nobody calibrated."""
    folder = tmp_path_factory.mktemp("swum")
    closed_loop(
        folder, LoopOptions(duration_s=180.0, video=False, robot="fixed", seed=5), say_nothing
    )
    for path in [*(folder / "trial" / "stats").iterdir(), *(folder / "trial" / "scores").iterdir()]:
        path.unlink()
    return folder


@pytest.fixture
def experiment(swum, tmp_path):
    """Return a copy of it, in which the robot is to be calibrated."""
    shutil.copytree(swum, tmp_path / "loop")
    tank, trial = (open_trial(tmp_path / "loop" / name) for name in ("tank", "trial"))
    options = LoopOptions(duration_s=180.0, video=False, settings=LITTLE, seed=5)
    return Experiment(tank=tank, trial=trial, options=options)


def made(root):
    """Return all that rounds make, as bytes."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for name in MADE
        for path in sorted((root / name).iterdir())
    }


def test_they_make_what_the_commands_make(experiment, tmp_path):
    """The same bytes, in a process of their own or one command after the other."""
    again = shutil.copytree(experiment.root, tmp_path / "again")
    heard = []
    with rounds_beside(experiment, heard.append) as rounds:
        rounds.begin()
        rounds.finish()
    analyse(again, AnalyseOptions(), say_nothing)
    calibrate(again, CalibrateOptions(settings=LITTLE), say_nothing)
    assert made(experiment.root) == made(again)
    assert "models/000180.toml" in made(again)
    told = [event.path.name for event in heard if isinstance(event, Made)]
    assert told.count("000120.toml") == 1
    assert [e.value["window_end_s"] for e in heard if isinstance(e, Result) and e.value][-1] == 180


def test_they_go_on_while_the_loop_does_something_else(experiment):
    """To begin keeps nobody waiting; nothing is promised before the end was waited for."""
    with rounds_beside(experiment, say_nothing) as rounds:
        rounds.begin()
        assert "models/000120.toml" not in made(experiment.root)
        rounds.wait()
        assert "models/000120.toml" in made(experiment.root)


def test_without_calibration_there_is_no_process(experiment):
    """Windows are analysed at the end, by who asks."""
    windows = Windows(root=experiment.root, settings=None, n_workers=None)
    rounds = RoundsBeside(windows, None, say_nothing)
    rounds.begin()
    rounds.wait()
    assert not (experiment.root / "stats" / "000120.parquet").exists()
    rounds.finish()
    assert sorted(made(experiment.root)) == [
        *("models/000000.toml", "scores/000120.parquet", "scores/000180.parquet"),
        *("stats/000120-following.parquet", "stats/000120.parquet"),
        *("stats/000180-following.parquet", "stats/000180.parquet"),
    ]


def test_before_the_first_minute_there_is_nothing_to_do(experiment):
    """No segment, no window, no error."""
    for path in (experiment.root / "tracks").iterdir():
        path.unlink()
    do_rounds(Windows.of(experiment), say_nothing)
    assert sorted(made(experiment.root)) == ["models/000000.toml"]


def test_what_goes_wrong_there_is_told_here(experiment):
    """In one line with its hint, as if it had happened in this process."""
    (experiment.root / "trial.toml").write_text("nonsense")
    with rounds_beside(experiment, say_nothing) as rounds:
        rounds.begin()
        with pytest.raises(ZfcalError, match=r"trial\.toml") as caught:
            rounds.wait()
    assert caught.value.hint


def test_a_process_that_is_gone_is_told(experiment):
    """The loop does not wait for ever, nor go on without models."""
    worker = Worker("rounds", do_rounds)
    rounds = RoundsBeside(Windows.of(experiment), worker, say_nothing)
    rounds.begin()
    os.kill(worker.process, signal.SIGKILL)
    with pytest.raises(ZfcalError, match="process of rounds ended"):
        rounds.wait()
    worker.stop()
