"""What tests do without a Debian package."""

import re
from pathlib import Path

import pytest


@pytest.fixture
def lacking(debian, monkeypatch):
    """Return the module, which knows one package more: one that nobody has."""
    monkeypatch.setitem(debian.PACKAGES, "nobody", ("zfcal-nobody", "/usr/lib/zfcal-nobody.so"))
    return debian


def test_what_is_there_is_found(debian, monkeypatch, tmp_path):
    """A program on the path, or a file; the first of several that is there."""
    there = tmp_path / "there.so"
    there.touch()
    monkeypatch.setitem(debian.PACKAGES, "some", ("zfcal-nobody", "sh"))
    monkeypatch.setitem(debian.PACKAGES, "file", ("/usr/lib/zfcal-nobody.so", str(there)))
    assert debian.need("some").name == "sh"
    assert debian.need("file") == there


@pytest.mark.parametrize("value", [None, ""])
def test_a_package_that_is_missing_at_home_skips(lacking, monkeypatch, value):
    """And says what to install."""
    monkeypatch.delenv("CI", raising=False)
    if value is not None:
        monkeypatch.setenv("CI", value)
    with pytest.raises(pytest.skip.Exception, match="apt-get install nobody"):
        lacking.need("nobody")


def test_a_package_that_is_missing_in_ci_fails(lacking, monkeypatch):
    """Never silently: what CI is to have installed is tested there, or nowhere."""
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match="apt-get install nobody"):
        lacking.need("nobody")


def test_ci_installs_all_that_is_needed_and_no_more(debian, repository):
    """The list in `.ci/run` is that of the tests; that run counts as CI, whoever starts it."""
    script = (repository / ".ci" / "run").read_text()
    (installed,) = re.findall(r"^packages=\((.*)\)$", script, re.MULTILINE)
    assert set(installed.split()) == set(debian.PACKAGES)
    assert "\nexport CI=" in script


def test_tests_that_need_a_package_ask_for_it(repository):
    """A file with the marker `apt` asks `debian.need`, and none finds such programs by itself."""
    asks = {}
    for path in sorted((repository / "tests").rglob("test_*.py")):
        text = path.read_text()
        if path.name != Path(__file__).name:
            marked, asked = "mark.apt" in text, "debian.need(" in text or "set_clock" in text
            asks[path.name] = (marked, asked)
            assert not re.search(r"which\(.(chromium|rsync|ip|faketime)", text), path.name
    assert [name for name, (marked, asked) in asks.items() if marked != asked] == []
    assert sum(marked for marked, _ in asks.values()) >= 5
