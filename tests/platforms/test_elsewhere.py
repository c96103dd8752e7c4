"""What runs on macOS and Windows, as far as a system that has more can show."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent

LINUX_ALONE = (
    "zfcal.drive",
    "zfcal.online",
    "zfcal.reproduction.twin",
    "zfcal.robot",
    "zfcal.virtual",
)
"""What need not work elsewhere: robots, the virtual rig, and what goes on beside an experiment."""

IMPORTING = """
from elsewhere import go_elsewhere

go_elsewhere()

import importlib, json, pkgutil
import zfcal, zfcal_cli

missing = {}
for root in (zfcal, zfcal_cli):
    for module in pkgutil.walk_packages(root.__path__, root.__name__ + "."):
        try:
            importlib.import_module(module.name)
        except (ImportError, AttributeError) as error:
            missing[module.name] = str(error)
print(json.dumps(missing))
"""

REFUSED = re.compile(
    r'[<>:"\\|?*\x00-\x1f]|[ .]$|^(con|prn|aux|nul|com\d|lpt\d)(\.|$)', re.IGNORECASE
)
"""Names that Windows gives no file."""


def run(folder, *words):
    """Run Python in a folder, with `elsewhere` to be imported."""
    return subprocess.run(
        [sys.executable, *map(str, words)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(HERE)},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


@pytest.mark.slow
def test_modules_need_nothing_that_one_system_has(tmp_path):
    """All but those that drive a robot can be imported; the commands are among them."""
    result = run(tmp_path, "-c", IMPORTING)

    assert result.returncode == 0, result.stderr
    missing = json.loads(result.stdout)
    assert {name: why for name, why in missing.items() if not name.startswith(LINUX_ALONE)} == {}
    # Something is taken away indeed.
    assert "fcntl" in missing["zfcal.robot.stopping"]


def test_what_drives_a_robot_says_that_it_needs_linux(tmp_path):
    """In place of a bug in zfcal."""
    code = """
from elsewhere import go_elsewhere

go_elsewhere()

from zfcal_cli.main import run

raise SystemExit(run(["drive", "--stop", "--port", "/dev/null"]))
"""
    result = run(tmp_path, "-c", code)

    assert result.returncode == 1
    assert "runs on Linux alone" in result.stderr
    assert "bug" not in result.stderr


@pytest.mark.slow
def test_a_working_day_runs_with_little(tmp_path, repository):
    """Every command of the main job, in one process, and the processes that draw."""
    sample = repository / "data-samples" / "two-rooms.csv.gz"

    result = run(tmp_path, HERE / "working_day.py", sample)

    ended = re.findall(r"^exit code (\d+) (\w+)$", result.stdout, re.MULTILINE)
    assert ended == [
        *(("0", name) for name in ("init", "import", "analyse", "calibrate", "simulate")),
        *(("0", name) for name in ("diagnose", "extend", "report", "export", "import", "compare")),
        # A set against itself is refused, and one trial is no verdict.
        ("1", "compare"),
        ("4", "reproduce"),
        ("0", "inspect"),
        ("0", "check"),
    ], result.stderr
    made = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert {path.relative_to(tmp_path).parts[0] for path in made} == {
        *("day", "later", "compared", "again"),
    }
    assert [path for path in made if REFUSED.search(path.name)] == []
    texts = [
        path for path in made if path.suffix in {".csv", ".json", ".toml", ".geojson", ".html"}
    ]
    assert len(texts) > 10
    assert [path for path in texts if b"\r" in path.read_bytes()] == []
