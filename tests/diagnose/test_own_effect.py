"""docs/architecture.md says how to add an effect: it is done here, to the letter."""

import dataclasses
import importlib
import re
import sys

import numpy as np
import pytest

from zfcal.diagnose.candidates import candidates_of, not_forms_of
from zfcal.diagnose.diagnose import diagnose
from zfcal.diagnose.findings import Verdict
from zfcal.diagnose.question import Question
from zfcal.model import effects
from zfcal.model.kernels import compiled
from zfcal.model.kernels.state import SPEED, WALL
from zfcal.report.effects_page import effects_page

NAME, MODULE = "wall-slowing", "zfcal.model.effects.wall_slowing"
SLOW = {NAME: {"strength": 0.8, "reach_m": 0.05}}


@pytest.fixture
def added(repository, tmp_path, monkeypatch):
    """Put the page's example among the effects, and return it."""
    page = (repository / "docs" / "architecture.md").read_text(encoding="utf-8")
    section = page.partition("## Add an effect")[2].partition("\n## ")[0]
    (code,) = re.findall(r"^```python\n(.*?)^```", section, re.DOTALL | re.MULTILINE)
    (tmp_path / "wall_slowing.py").write_text(code, encoding="utf-8")
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(tmp_path)])
    # What is compiled from a place of this test is of no use to another one.
    monkeypatch.setattr(compiled, "KEPT", False)
    forget()
    yield effects.find_effect(NAME)
    forget()


def forget():
    """Let effects be found anew."""
    sys.modules.pop(MODULE, None)
    importlib.invalidate_caches()
    effects.all_effects.cache_clear()
    effects._effect_of.cache_clear()


def test_it_is_on_the_list_and_on_the_page(added):
    """By its file alone; its other form is not asked for once it is known."""
    assert added in effects.all_effects()
    assert f"## `{NAME}`\n\n{added.says} *Negative:* {added.opposite}" in effects_page()


def test_its_other_form_is_not_asked_for_beside_it(added, tank):
    """All else beyond the list is."""
    generic = candidates_of(effects.generic_effects(), tank)
    left = not_forms_of(generic, {added.name})
    assert {each.name for each in generic} - {each.name for each in left} == {"generic:speed:wall"}


@pytest.mark.usefixtures("added")
def test_fish_with_it_are_slow_along_the_walls(screen):
    """By a factor of 0.45 at the wall, of one in the middle; the other fish by none."""
    slow, usual = (screen(41, given, minutes=4.0).scene for given in (SLOW, {}))

    def mean_speed(scene, near):
        wall_m, speed = scene.states[:, WALL], scene.states[:, SPEED]
        return speed[np.where(near, wall_m < 0.02, wall_m > 0.1)].mean()

    assert mean_speed(slow, near=True) < 0.6 * mean_speed(usual, near=True)
    assert mean_speed(slow, near=False) == pytest.approx(mean_speed(usual, near=False), rel=0.1)


@pytest.mark.slow
@pytest.mark.usefixtures("added")
def test_a_recording_of_such_fish_shows_it(record, tank, fish):
    """It is named and measured, drawn against the wall, and in the extended model."""
    question = Question(
        samples=record(41, SLOW, minutes=4.0), arena=tank, model=fish, noise_m=0.0,
        noise_source="known", n_null=5, quick=True, seed=1, n_workers=2,
    )  # fmt: skip
    found = diagnose(question, lambda _stage, _done, _all: None)

    assert found.verdict is Verdict.NAMED
    (effect,) = found.effects
    assert effect.name == NAME
    assert effect.says.startswith("Fish swim more slowly close to a wall.")
    low, high = effect.interval["strength"]
    assert low < 0.8 < high
    assert effect.trace.cue_name == "distance to the wall (cm)"
    assert found.extended == dataclasses.replace(
        found.extended, effects={NAME: {"strength": effect.strength["strength"], "reach_m": 0.05}}
    )
