"""Models for a rig of the older software, as they appear, with the real command."""

import importlib.util
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from zfcal.artifacts.models import read_model
from zfcal.robot.cats import settings_of

pytest.importorskip("zmq", reason="needs pyzmq: the extra zfcal[cats]")


def _module(name, path):
    spec = importlib.util.spec_from_file_location(name, path)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


_HERE = Path(__file__).parent
driven = _module("driven", _HERE / "driven.py")
older_rig = _module("older_rig", _HERE.parent / "robot" / "older_rig.py")

ZONES = ("corridor", "centre", "centre", "walls", "walls")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a trial with its starting model."""
    return driven.make_trial(tmp_path_factory.mktemp("published") / "trial")


@pytest.fixture
def root(made, tmp_path):
    """Return a copy of it."""
    return Path(shutil.copytree(made, tmp_path / "trial"))


def words_of(root, port, *words, before=()):
    """Return the words of a command that publishes."""
    command = [sys.executable, *(before or ("-m", "zfcal_cli.main"))]
    return [*command, "drive", str(root), "--publish", f"cats2://127.0.0.1:{port}", *words]


def said_by(words):
    """Run a command; return its exit code and what it said."""
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr


@pytest.mark.slow
def test_each_model_reaches_the_rig_within_a_second(root):
    """The newest one at first, and a new one as soon as it appears; exit 0 when it was taken."""
    first = settings_of(read_model(root / "models" / "000000.toml"), ZONES)
    with older_rig.Rig({path: [0.5] for path in first}) as rig:
        words = words_of(root, rig.port, "--publish-zones", ",".join(ZONES), "--duration", "4s")
        with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:

            def until(model, patience_s):
                wanted = settings_of(model, ZONES)
                ends_s = time.monotonic() + patience_s
                while any(
                    rig.settings[path] != pytest.approx(list(values), rel=1e-6)
                    for path, values in wanted.items()
                ):
                    assert time.monotonic() < ends_s, process.poll()
                    time.sleep(0.01)

            until(read_model(root / "models" / "000000.toml"), 60)
            until(read_model(driven.add_model(root, 120)), 1.0)
            said = process.communicate(timeout=60)[1]
            assert process.returncode == 0, said
    assert "models/000000.toml is sent to cats2://127.0.0.1" in said
    assert "models/000120.toml: cats2://127.0.0.1" in said
    assert "has taken 30 settings" in said


@pytest.mark.slow
def test_a_rig_that_is_not_there_is_exit_code_1(root):
    """At the end of --duration; without --publish-zones the trial's own zones count."""
    with older_rig.Rig({}) as rig:
        port = rig.port
    code, said = said_by(words_of(root, port, "--duration", "1s"))
    assert code == 1
    assert "18 settings of models/000000.toml were not taken" in said


def test_without_the_extra_it_says_what_to_install(root):
    """One line and a hint, exit code 1."""
    program = (
        "import sys; sys.modules['zmq'] = None\n"
        "from zfcal_cli.main import run; sys.exit(run(sys.argv[1:]))\n"
    )
    code, said = said_by(words_of(root, 5557, before=("-c", program)))
    assert code == 1
    assert "needs the package pyzmq" in said
    assert "pip install 'zfcal[cats]'" in said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("--publish", "rig:5557"), 1, "is no address of a rig"),
        (("--publish", "cats2://rig", "--publish-zones", "ring"), 1, "has no zone ring"),
        (("--publish", "cats2://rig", "--port", "virtual"), 2, "the rig drives its robot itself"),
        (("--publish", "cats2://rig", "--replay"), 2, "--publish cannot be given with --replay"),
        (("--publish-zones", "a", "--port", "virtual"), 2, "--publish-zones is for --publish"),
    ],
)
def test_what_cannot_be_published(root, words, code, says):
    """Said in one line, before anything is sent."""
    command = [sys.executable, "-m", "zfcal_cli.main", "drive", str(root), *words]
    found, said = said_by(command)
    assert found == code
    assert says in " ".join(said.split())
