"""The whole chain by commands: from fish with a hidden effect to a robot that has it."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import pytest

from zfcal.artifacts.drive_files import drive_files, read_drive
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import read_model, write_model

_spec = importlib.util.spec_from_file_location(
    "driven", Path(__file__).resolve().parents[1] / "drive" / "driven.py"
)
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)

NAME, STRENGTH = "turning-bias", 1.5
ROUND = ["--generations", "1", "--population", "8", "--workers", "2"]


@pytest.mark.slow
def test_a_hidden_effect_reaches_the_robot(zfcal, tmp_path):
    """Simulated, diagnosed, extended, calibrated; a numbered model and a named one drive."""
    root = tmp_path / "trial"
    words = ["--arena", "two-rooms", "--fish", 4, "--robot", "--fps", 15, "-q"]

    def done(*argv):
        found = zfcal(*argv)
        assert found.code == 0, found.err
        return found

    done("init", "trial", *words)
    model = read_model(root / "models" / "000000.toml")
    hidden = replace(model, effects={NAME: {"strength": STRENGTH}})
    write_model(tmp_path / "hidden.toml", hidden, Lineage(schema="zfcal.model/1", command="init"))
    done("simulate", "trial", "--model", "hidden.toml", "--duration", "4min")
    done("analyse", "trial")
    done("diagnose", "trial", "--quick")
    done("extend", "trial", *ROUND)
    extended = read_model(root / "models" / "extended.toml").effects
    assert NAME in extended
    done("calibrate", "trial", "--model", "trial/models/extended.toml", *ROUND)
    strengths = []
    for end in ("000120", "000180", "000240"):
        effects = read_model(root / "models" / f"{end}.toml").effects
        assert list(effects) == list(extended)
        strengths.append(effects[NAME]["strength"])
    assert len({*strengths, extended[NAME]["strength"]}) > 1
    driven.write_poses(root, driven.frames_of(root, 4))
    names = {
        "models/000240.toml": [],
        "models/extended.toml": ["--model", "trial/models/extended.toml"],
    }
    for name, chosen in names.items():
        drive = ["drive", "trial", "--port", "virtual", "--clock", "poses", "--duration", "3s"]
        done(*drive, "--force", *chosen)
        items = [item for path in drive_files(root).values() for item in read_drive(path)]
        targets = [item for item in items if item["what"] == "target"]
        assert {target["model"] for target in targets} == {name}
        assert len(targets) >= 15
        done("drive", "trial", "--replay")
