"""The wheel, and an environment that has it where no checkout is.

Dependencies are those of the lock, shared with the environment of the tests by a path file; zfcal
itself comes from the wheel alone, in an environment that knows no checkout.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import venv
from dataclasses import dataclass
from pathlib import Path

import pytest

TREE = ("zfcal", "cli", "schemas", "pyproject.toml", "README.md", "LICENSE")
BUILD = "from setuptools.build_meta import build_{0}; print(build_{0}({1!r}))"


def build(kind, source, place):
    """Build ``wheel`` or ``sdist`` with the builder of the lock; return the file."""
    place.mkdir(exist_ok=True)
    words = [sys.executable, "-c", BUILD.format(kind, str(place))]
    done = subprocess.run(words, cwd=source, check=True, capture_output=True, text=True)
    return place / done.stdout.splitlines()[-1]


@pytest.fixture(scope="session")
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


@dataclass(frozen=True)
class Installed:
    """An environment with zfcal from a wheel.

    Parameters
    ----------
    folder
        The environment.
    """

    folder: Path

    def run(self, place, *words, **environment):
        """Run a program in a folder and return what it says; nothing leads it to the checkout.

        Keywords are added to the shell's variables.
        """
        env = {k: v for k, v in os.environ.items() if k not in {"PYTHONPATH", "VIRTUAL_ENV"}}
        words = [str(self.folder / "bin" / words[0]), *map(str, words[1:])]
        done = subprocess.run(
            words,
            cwd=place,
            env={**env, **environment},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{words}: {done.stderr}"
        return done.stdout


@pytest.fixture(scope="session")
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
    return Installed(folder)
