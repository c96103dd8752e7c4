"""What tests of benchmarks share: scripts as modules, and run as their commands."""

import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def script(repository):
    """Return what imports a module of benchmarks/ by its folder and its name."""
    before = list(sys.path)
    sys.path.insert(0, str(repository))
    yield lambda name: importlib.import_module(f"benchmarks.{name}")
    sys.path[:] = before


@pytest.fixture
def command(repository, briefly):
    """Return what runs a script as its command and gives what it says; its rounds are brief."""

    def run(path, *words):
        line = [sys.executable, repository / "benchmarks" / path, *words]
        done = subprocess.run(line, capture_output=True, text=True, check=False, env=briefly)
        assert done.returncode == 0, done.stderr
        return done

    return run


@pytest.fixture
def tiny(command, tmp_path):
    """Return what runs a script with its smallest effort and gives its figures and document."""

    def run(path, *words):
        done = command(path, "--tiny", "--out", tmp_path, *words)
        name = Path(path).stem.removeprefix("bench_")
        found = json.loads((tmp_path / f"{name}.json").read_text(encoding="utf-8"))
        document = tmp_path / f"benchmarks-{name.replace('_', '-')}.md"
        text = document.read_text(encoding="utf-8")
        assert text.startswith("# ")
        assert f"benchmarks/{path}" in text
        assert text in done.stdout
        return found, text

    return run
