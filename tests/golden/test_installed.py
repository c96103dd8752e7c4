"""The wheel and the source archive, installed where no checkout is.

What the installed command makes of a trial is in `test_golden_trial.py`.
"""

import hashlib
import json
import tomllib
import zipfile

import pytest

DATA = (
    "zfcal/py.typed",
    "zfcal/arenas/two-rooms.geojson",
    "zfcal/model/kernels/compiled.py",
    "zfcal/schemas/trial.schema.json",
)

pytestmark = pytest.mark.slow


def contents(wheel):
    """Return the hash of each file in a wheel; RECORD lists the others."""
    with zipfile.ZipFile(wheel) as archive:
        return {
            name: hashlib.sha256(archive.read(name)).hexdigest()
            for name in archive.namelist()
            if not name.endswith("/RECORD")
        }


def test_the_source_archive_makes_the_same_wheel(built):
    """Nothing that the wheel needs is left out of the archive."""
    direct, again = map(contents, built)
    assert direct == again
    assert set(DATA) <= direct.keys()


def test_the_installed_package_is_that_of_the_wheel(installed, repository, tmp_path):
    """Both roots and the data lie in the new environment; the version is that of the project."""
    program = (
        "import zfcal, zfcal_cli, zfcal.schemas, importlib.resources as r\n"
        "print(zfcal.__file__, zfcal_cli.__file__, zfcal.schemas.__file__, sep='\\n')\n"
        "print((r.files('zfcal') / 'py.typed').is_file())\n"
    )
    *places, is_typed = installed.run(tmp_path, "python", "-c", program).splitlines()
    assert all(place.startswith(str(installed.folder)) for place in places)
    assert is_typed == "True"
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    said = json.loads(installed.run(tmp_path, "zfcal", "--version", "--json"))
    assert said["zfcal"] == project["version"]
    assert "numba" in said["libraries"]
