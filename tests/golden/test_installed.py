"""The wheel and the source archive, installed where no checkout is.

Dependencies are those of the lock, shared with the environment of the tests by a path file; zfcal
itself comes from the wheel alone, in an environment that knows no checkout.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest

TREE = ("zfcal", "cli", "schemas", "pyproject.toml", "README.md", "LICENSE")
DATA = (
    "zfcal/py.typed",
    "zfcal/arenas/two-rooms.geojson",
    "zfcal/model/kernels/compiled.py",
    "zfcal/schemas/trial.schema.json",
)
BUILD = "from setuptools.build_meta import build_{0}; print(build_{0}({1!r}))"

pytestmark = pytest.mark.slow


def build(kind, source, place):
    """Build ``wheel`` or ``sdist`` with the builder of the lock; return the file."""
    place.mkdir(exist_ok=True)
    words = [sys.executable, "-c", BUILD.format(kind, str(place))]
    done = subprocess.run(words, cwd=source, check=True, capture_output=True, text=True)
    return place / done.stdout.splitlines()[-1]


@pytest.fixture(scope="module")
def built(repository, tmp_path_factory):
    """Return the wheel of the tree, and the one of its source archive."""
    place = tmp_path_factory.mktemp("built")
    tree = place / "tree"
    tree.mkdir()
    for name in TREE:
        source = repository / name
        ignore = shutil.ignore_patterns("__pycache__", ".*")
        if source.is_dir():
            shutil.copytree(source, tree / name, ignore=ignore)
        else:
            shutil.copy(source, tree)
    archive = build("sdist", tree, place / "sdist")
    with tarfile.open(archive) as packed:
        packed.extractall(place / "unpacked", filter="data")
    (unpacked,) = (place / "unpacked").iterdir()
    return build("wheel", tree, place / "direct"), build("wheel", unpacked, place / "again")


def contents(wheel):
    """Return the hash of each file in a wheel; RECORD lists the others."""
    with zipfile.ZipFile(wheel) as archive:
        return {
            name: hashlib.sha256(archive.read(name)).hexdigest()
            for name in archive.namelist()
            if not name.endswith("/RECORD")
        }


@dataclass(frozen=True)
class Installed:
    """An environment with zfcal from a wheel.

    Parameters
    ----------
    folder
        The environment.
    place
        An empty folder to work in.
    """

    folder: Path
    place: Path

    def run(self, *words):
        """Run a program of the environment; nothing leads it to the checkout."""
        env = {k: v for k, v in os.environ.items() if k not in {"PYTHONPATH", "VIRTUAL_ENV"}}
        words = [str(self.folder / "bin" / words[0]), *map(str, words[1:])]
        done = subprocess.run(
            words, cwd=self.place, env=env, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout


@pytest.fixture(scope="module")
def installed(built, tmp_path_factory):
    """Return a new environment with the wheel."""
    folder = tmp_path_factory.mktemp("fresh") / "env"
    venv.create(folder, symlinks=True)
    program = folder / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(program), "install", "--quiet"]
    offline = ["--no-index", "--no-deps", str(built[1])]
    subprocess.run([*pip, *offline], check=True, capture_output=True)
    (site,) = (folder / "lib").glob("python3*/site-packages")
    # The path files in there, and with them that of the checkout, are not read.
    (site / "locked.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    return Installed(folder, tmp_path_factory.mktemp("empty"))


def test_the_source_archive_makes_the_same_wheel(built):
    """Nothing that the wheel needs is left out of the archive."""
    direct, again = map(contents, built)
    assert direct == again
    assert set(DATA) <= direct.keys()


def test_the_installed_package_is_that_of_the_wheel(installed, repository):
    """Both roots and the data lie in the new environment; the version is that of the project."""
    program = (
        "import zfcal, zfcal_cli, zfcal.schemas, importlib.resources as r\n"
        "print(zfcal.__file__, zfcal_cli.__file__, zfcal.schemas.__file__, sep='\\n')\n"
        "print((r.files('zfcal') / 'py.typed').is_file())\n"
    )
    *places, is_typed = installed.run("python", "-c", program).splitlines()
    assert all(place.startswith(str(installed.folder)) for place in places)
    assert is_typed == "True"
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    said = json.loads(installed.run("zfcal", "--version", "--json"))
    assert said["zfcal"] == project["version"]
    assert "numba" in said["libraries"]


def test_the_installed_command_does_the_main_job(installed, repository):
    """From tracks to a report with a calibrated model, in an empty folder; and the manual."""
    sample = repository / "data-samples" / "two-rooms.csv.gz"
    few = ("--generations", 1, "--population", 4, "--steps", 100)
    words = ("--arena", "two-rooms", "--fish", 4, "--robot", "--fps", 15)
    installed.run("zfcal", "init", "trial", *words)
    installed.run("zfcal", "import", sample, "trial", "--format", "csv")
    installed.run("zfcal", "analyse", "trial")
    installed.run("zfcal", "calibrate", "trial", *few)
    installed.run("zfcal", "report", "trial")
    installed.run("zfcal", "check", "trial")
    trial = installed.place / "trial"
    assert (trial / "models" / "000360.toml").is_file()
    assert "<svg" in (trial / "report" / "index.html").read_text()
    assert "man1/zfcal.1" in installed.run("zfcal", "--man", "man1")
