"""Manual pages, and what a bug report needs."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from zfcal_cli.main import COMMANDS, group
from zfcal_cli.manual import page


@pytest.fixture
def pages(zfcal):
    """Return the pages that are written, in an empty folder."""
    done = zfcal("--man", "man1")
    assert done.code == 0, done.err
    return {Path(line).name: Path(line) for line in done.lines}


def test_every_command_has_a_page(pages):
    """Of the whole, of each command, of each subcommand; with every long option."""
    assert {"zfcal.1", *(f"zfcal-{name}.1" for name in COMMANDS)} <= pages.keys()
    assert "zfcal-camera-align.1" in pages
    text = pages["zfcal-calibrate.1"].read_text()
    command = group.get_command(None, "calibrate")
    shown_ones = [each for each in command.params if not getattr(each, "hidden", False)]
    options = [o for each in shown_ones for o in each.opts if o.startswith("--")]
    assert len(options) > 10
    for option in options:
        assert option.replace("-", "\\-") in text
    assert ".SS The robot" in pages["zfcal.1"].read_text()


def test_a_page_names_the_page_above_it(pages):
    """As the file is called, with hyphens: man finds no name with a space."""
    ends = {name: path.read_text().splitlines()[-2:] for name, path in pages.items()}
    assert ends["zfcal-camera-align.1"] == [".SH SEE ALSO", ".BR zfcal\\-camera (1)"]
    assert ends["zfcal-camera.1"] == [".SH SEE ALSO", ".BR zfcal (1)"]


def test_signs_are_no_orders_to_the_formatter(pages):
    """Lines of an example stay lines, and no text begins with a dot or holds a bare backslash."""
    text = pages["zfcal-drive.1"].read_text()
    example = text.split(".nf\n")[1].split("\n.fi")[0]
    assert "    zfcal drive \\-\\-stop \\-\\-port /dev/rfcomm5" in example.splitlines()
    allowed = {".TH", ".SH", ".SS", ".PP", ".TP", ".B", ".BR", ".nf", ".fi"}
    for path in pages.values():
        orders = {
            line.split()[0] for line in path.read_text().splitlines() if line and line[0] in ".'"
        }
        assert orders <= allowed


@pytest.mark.apt
def test_man_shows_each_page_without_a_warning(pages, debian):
    """The formatter itself reads them."""
    debian.need("man-db")
    for name, path in pages.items():
        words = ["man", "--warnings", "-l", "-E", "ascii", str(path)]
        env = os.environ | {"MANPAGER": "cat", "MANWIDTH": "100", "LC_ALL": "C.UTF-8"}
        done = subprocess.run(words, capture_output=True, text=True, check=True, env=env)
        assert done.stderr == "", name
        assert "EXIT STATUS" in done.stdout
    assert "--optimiser [zfcal|deap]" in shown(pages["zfcal-calibrate.1"])


def shown(path):
    """Return a page as a reader sees it."""
    words = ["man", "-l", "-E", "ascii", str(path)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return done.stdout


def test_a_page_is_the_same_each_time():
    """No date stands in it."""
    import click

    context = click.Context(group, info_name="zfcal")
    assert page(context, {}, "1.2.3") == page(context, {}, "1.2.3")
    assert page(context, {}, "1.2.3").startswith('.TH "ZFCAL" "1" "" "zfcal 1.2.3"')


def test_a_folder_that_cannot_be_is_an_error(zfcal):
    """A file stands in its place: one line, no traceback."""
    Path("man1").write_text("")
    assert zfcal("--man", "man1").code == 2


@pytest.mark.parametrize("words", [("--version", "--json"), ("--json", "--version")])
def test_a_bug_report_has_what_is_needed_and_nobody(zfcal, words, monkeypatch):
    """Versions, platform, threads, kernels; no name of a user or computer, no path of a home."""
    done = zfcal(*words)
    found = json.loads(done.out)
    assert found["zfcal"] == zfcal("--version").out.split()[1]
    assert {"numpy", "numba", "pyarrow", "click"} <= found["libraries"].keys()
    assert found["threads"]["usable"] >= 1
    assert set(found["kernels"]) == {"kept", "compiled", "folder"}
    assert str(Path.home()) not in done.out
    values = [found["platform"], found["kernels"]["folder"]]
    assert all(f" {os.uname().nodename} " not in f" {value} " for value in values)


def test_a_place_from_the_environment_is_named_by_its_variable(monkeypatch, tmp_path):
    """The path itself may hold a name."""
    from zfcal_cli.version import _without_person

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert _without_person(tmp_path / "zfcal" / "kernels-1") == "$NUMBA_CACHE_DIR/zfcal/kernels-1"
    assert _without_person(Path("/elsewhere/somebody/kernels-1")) == "kernels-1"


def test_json_before_a_command_is_wrong_usage(zfcal):
    """The hint shows where it stands."""
    done = zfcal("--json", "check", ".")
    assert done.code == 2
    assert "zfcal check ... --json" in done.err
