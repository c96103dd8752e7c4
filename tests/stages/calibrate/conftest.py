"""What tests of the calibration share."""

import shutil

import pytest

from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.events import say_nothing


@pytest.fixture(scope="module")
def analyse_once(made_once, tmp_path_factory):
    """Return what makes a trial of three fish with its statistics, given its length in seconds."""

    def make(duration_s):
        root = tmp_path_factory.mktemp("analysed") / "trial"
        shutil.copytree(made_once(duration_s, 3, 0, 1), root)
        analyse(root, AnalyseOptions(), say_nothing)
        return root

    return make
