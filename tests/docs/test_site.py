"""The site of the documentation: what is made from the code, and that it needs no network."""

import importlib.util
import json
import os
import re
import subprocess

import pytest

from zfcal import errors
from zfcal.behaviour.features.registry import statistics
from zfcal.model.effects import all_effects
from zfcal_cli import output
from zfcal_cli.main import group

OPTIONS = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=10000"]


@pytest.fixture(scope="module")
def made(repository):
    """Return the module that makes pages from the code."""
    spec = importlib.util.spec_from_file_location("made", repository / "docs" / "made.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_each_command_and_option_is_on_the_page(made, reading):
    """As its help prints them."""
    page = made.commands()
    for command in reading.commands_below(group):
        for word in reading.options_of(command):
            assert word in page, (command.name, word)
    assert "## zfcal\n" in page
    assert "### zfcal camera corners\n" in page


def test_each_field_of_each_file_is_on_the_page(made, repository):
    """Of JSON, of TOML and of tables."""
    page = made.schemas()
    for path in (repository / "schemas").glob("*.json"):
        document = json.loads(path.read_text(encoding="utf-8"))
        assert f"`schemas/{path.name}`" in page
        names = [*document.get("properties", ()), *(c["name"] for c in document.get("columns", ()))]
        for name in names:
            assert f"| `{name}` |" in page, (path.name, name)


def test_statistics_effects_and_errors_are_on_the_page(made):
    """All that there are, by name."""
    for name in statistics():
        assert f"| `{name}` |" in made.statistics()
    for effect in all_effects():
        assert f"[`{effect.name}`]" in made.effects()
    assert f"| `LockedError` | {errors.LockedError.exit_code} |" in made.errors()


def test_every_exit_code_has_its_row(repository):
    """Those of errors, and those that the command line adds."""
    page = (repository / "docs" / "commands.md").read_text(encoding="utf-8")
    classes = [each for each in vars(errors).values() if hasattr(each, "exit_code")]
    named = {value for name, value in vars(output).items() if name.startswith("EXIT_")}
    for code in {0, 2, 141, 143, *named, *(each.exit_code for each in classes)}:
        assert re.search(rf"^\| (\d+, )?{code}(, \d+)? \|", page, re.MULTILINE), code


def test_a_page_that_asks_for_what_is_not_made_is_an_error(made):
    """And not a hole in the page."""
    source = ["<!-- made: errors -->"]
    made.insert(None, "page", source)
    assert "`ZfcalError`" in source[0]
    with pytest.raises(KeyError, match="nothing"):
        made.insert(None, "page", ["<!-- made: nothing -->"])


def test_every_page_is_in_the_navigation(repository):
    """No page can be reached by search alone."""
    docs = repository / "docs"
    pages = {path.relative_to(docs).with_suffix("").as_posix() for path in docs.rglob("*.md")}
    named = {"index"}
    for page in docs.rglob("*.md"):
        for block in re.findall(r"```\{toctree\}\n(.*?)```", page.read_text("utf-8"), re.DOTALL):
            lines = [line for line in block.splitlines() if line and not line.startswith(":")]
            named |= {(page.parent / line).relative_to(docs).as_posix() for line in lines}
    assert named == pages


@pytest.fixture(scope="module")
def site(repository):
    """Return where `make docs` put the site; without one skip, but fail in CI, which makes it."""
    place = repository / "build" / "docs"
    if not (place / "index.html").exists():
        lacks = "no site in build/docs: make docs"
        if os.environ.get("CI"):
            pytest.fail(lacks, pytrace=False)
        pytest.skip(lacks)
    return place


@pytest.mark.slow
def test_pages_load_nothing_from_elsewhere(site):
    """No script, style, font or picture has an address; links to read are another thing."""
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r"<(?:script|img|iframe)[^>]*src=\"([^\"]+)\"", text)
        loaded += re.findall(r"<link[^>]*rel=\"stylesheet\"[^>]*href=\"([^\"]+)\"", text)
        assert [address for address in loaded if "//" in address] == [], page.name
    for style in site.rglob("*.css"):
        assert not re.search(r"(@import|url\()\s*[\"']?(https?:)?//", style.read_text("utf-8"))


@pytest.mark.slow
@pytest.mark.apt
def test_a_search_works_from_the_folder(site, debian, tmp_path):
    """Without a server and without a network."""
    done = subprocess.run(
        [
            debian.need("chromium"),
            *OPTIONS,
            "--host-resolver-rules=MAP * ~NOTFOUND",
            f"--user-data-dir={tmp_path}",
            "--dump-dom",
            f"{(site / 'search.html').as_uri()}?q=hellinger",
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert re.search(r"found \d+ pages? matching", done.stdout)
    assert "What S says" in done.stdout
