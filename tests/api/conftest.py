"""A small analysed trial and one of fish alone, as a person has them in a folder."""

import importlib.util
import os
import shutil
from pathlib import Path

import pytest

from zfcal.calibrate.task import Settings
from zfcal_cli.main import run

BRIEF = Path(__file__).resolve().parents[1] / "brief.py"


@pytest.fixture(scope="module", autouse=True)
def brief():
    """Let rounds confirm little, as in the tests of the commands."""
    spec = importlib.util.spec_from_file_location("brief", BRIEF)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in module.LESS.items():
            patch.setitem(Settings.__init__.__kwdefaults__, name, value)
        yield


@pytest.fixture(scope="session")
def made(tmp_path_factory, made_once):
    """Return a folder with ``trial``, 200 s of fish and a robot, analysed, and ``alone``."""
    folder = tmp_path_factory.mktemp("api")
    shutil.copytree(made_once(200, 3, 1, 1), folder / "trial")
    shutil.copytree(made_once(200, 3, 0, 2), folder / "alone")
    for name in ("trial", "alone"):
        assert run(["analyse", str(folder / name), "-q"]) == 0
    return folder


@pytest.fixture
def here(made, tmp_path, monkeypatch):
    """Stand in a copy of that folder."""
    folder = shutil.copytree(made, tmp_path / "here")
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def children():
    """Return what counts the processes that this one has started and that still are."""

    def count():
        tasks = Path("/proc/self/task")
        words = [(task / "children").read_text().split() for task in tasks.iterdir()]
        return {int(word) for each in words for word in each} - {os.getpid()}

    return count
