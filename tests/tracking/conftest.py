"""What the tests of tracking share."""

import importlib.util
from pathlib import Path

import pytest

_FOLDER = Path(__file__).parent


@pytest.fixture(scope="session")
def drawn():
    """Return the module that draws frames of fish whose positions are known."""
    spec = importlib.util.spec_from_file_location("drawn_tank", _FOLDER / "drawn_tank.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
