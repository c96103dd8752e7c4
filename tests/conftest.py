"""What all tests share: where the real recordings lie, and how hypothesis runs."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

REPOSITORY = Path(__file__).resolve().parents[1]

# The first call of a kernel compiles it, which no deadline allows for.
settings.register_profile("zfcal", deadline=None)
settings.register_profile("zfcal-ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("zfcal-ci" if os.environ.get("CI") else "zfcal")


def pytest_collection_modifyitems(items):
    """Leave out what needs a real robot or camera, unless it is asked for."""
    if os.environ.get("ZFCAL_HARDWARE") == "1":
        return
    skip = pytest.mark.skip(reason="talks to real hardware; set ZFCAL_HARDWARE=1 to run it")
    for item in items:
        if "hardware" in item.keywords:
            item.add_marker(skip)


@pytest.fixture(scope="session")
def repository():
    """Return the root of the source tree."""
    return REPOSITORY


@pytest.fixture(scope="session")
def shared_data():
    """Return the folder of real recordings, or skip: they are no part of the project."""
    asked = os.environ.get("ZFCAL_SHARED_DATA")
    folder = Path(asked) if asked else REPOSITORY.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no real recordings at {folder}; ZFCAL_SHARED_DATA names another place")
    return folder.resolve()


@pytest.fixture(scope="session")
def recording():
    """Return what finds a recording by its name, or skips; `make real-data` brings two."""
    places = [os.environ.get("ZFCAL_SHARED_DATA"), REPOSITORY.parent / "shared" / "data"]
    folders = [Path(place) for place in places if place] + [REPOSITORY / "real-data"]

    def find(name):
        for folder in folders:
            if (folder / name).is_dir():
                return (folder / name).resolve()
        return pytest.skip(f"no recording {name!r} in {', '.join(map(str, folders))}")

    return find
