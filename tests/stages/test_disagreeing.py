"""No command scores tracks of other agents than trial.toml states."""

import pytest

from zfcal.artifacts.checking import check_trial
from zfcal.artifacts.findings import ERROR
from zfcal.errors import InputError
from zfcal.report.gather import gather
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.calibrate.calibrate import calibrate
from zfcal.stages.calibrate.holdout import Span, calibrate_span
from zfcal.stages.diagnose.diagnose import DiagnoseOptions, diagnose
from zfcal.stages.events import say_nothing
from zfcal.stages.extend.extend import ExtendOptions, extend
from zfcal.stages.trial_context import Task


@pytest.fixture
def disagreeing(make_trial):
    """Return a trial of three fish whose settings state two."""
    root = make_trial(seconds=120)
    text = (root / "trial.toml").read_text()
    (root / "trial.toml").write_text(text.replace("n_fish = 3", "n_fish = 2"))
    return root


COMMANDS = {
    "analyse": lambda root, _: analyse(root, AnalyseOptions(), say_nothing),
    "calibrate": lambda root, quick: calibrate(root, quick, say_nothing),
    "calibrate --window": lambda root, quick: calibrate_span(
        root, Span(train_s=(0, 120), output=root / "x.toml"), quick, say_nothing
    ),
    "diagnose": lambda root, _: diagnose(root, DiagnoseOptions(), say_nothing),
    "extend": lambda root, _: extend(root, ExtendOptions(), say_nothing),
    "report": lambda root, _: gather(root, say_nothing),
    "a dry run": lambda root, _: analyse(
        root, AnalyseOptions(), say_nothing, task=Task(dry_run=True)
    ),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_trial_that_its_tracks_contradict_is_refused(disagreeing, quick, read_all, command):
    """Before anything is made of them, and up to date or not."""
    before = read_all(disagreeing)
    with pytest.raises(InputError, match="n_fish = 2 and n_robots = 0 are 2 agents"):
        COMMANDS[command](disagreeing, quick)
    assert read_all(disagreeing) == before


def test_a_control_trial_that_its_tracks_contradict_is_refused(disagreeing, make_trial):
    """Its fish would be scored against those of another tank."""
    options = AnalyseOptions(control=(disagreeing,))
    with pytest.raises(InputError, match=f"{disagreeing / 'trial.toml'}: n_fish = 2"):
        analyse(make_trial("robot", seconds=120, n_robots=1), options, say_nothing)


def test_a_check_names_what_contradicts_the_tracks(disagreeing):
    """As an error, which is a failing exit code."""
    found = [(f.where, f.says) for f in check_trial(disagreeing) if f.level == ERROR]
    says = "n_fish = 2 and n_robots = 0 are 2 agents, the tracks hold 3 at once"
    assert found == [("trial.toml", says)]
