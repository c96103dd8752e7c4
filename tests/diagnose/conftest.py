"""Scenes of the base model, made once."""

import importlib.util
from pathlib import Path

import pytest

_PATH = Path(__file__).parent / "worlds_for_diagnosis.py"


@pytest.fixture(scope="session")
def worlds():
    """Return the module that makes recordings with a known answer."""
    spec = importlib.util.spec_from_file_location("worlds_for_diagnosis", _PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def base(worlds):
    """Return scene and fitted model of ten minutes of fish that do as the base model does."""
    return worlds.fitted_scene(worlds.base_walk(11, minutes=10))
