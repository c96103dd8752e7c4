"""What the tests of the documentation share: its snippets, and where they may stand."""

import importlib.util
from pathlib import Path

import pytest


def _module(name):
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def reading():
    """Return the module that reads snippets out of pages."""
    return _module("snippets")


@pytest.fixture(scope="session")
def snippets(repository, reading):
    """Return all code of all pages."""
    pages = reading.pages_of(repository)
    return [each for page in pages for each in reading.snippets_of(repository, page)]
