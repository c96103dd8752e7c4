"""Commands of the pages run in a fresh folder, one after the other, and give what stands there."""

import os
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.tables import read_tracks


def stories():
    """Return the module of stories, as parameters are needed before there are fixtures."""
    import importlib.util

    spec = importlib.util.spec_from_file_location("stories", Path(__file__).with_name("stories.py"))
    module = importlib.util.module_from_spec(spec)
    sys.modules["stories"] = module
    spec.loader.exec_module(module)
    return module


TOLD = stories()
CASES = [pytest.param(each, id=each.name) for each in TOLD.STORIES]


def needs(line):
    """Return what a command needs that no test has; None where it can be run."""
    return next((what for word, what in TOLD.NOT_RUN.items() if word in f"{line} "), None)


def is_part(snippet, page, heading):
    """Say whether a snippet stands in a section."""
    return snippet.page == page and heading in {None, snippet.heading}


def test_every_command_is_in_a_story_or_named(snippets, reading):
    """With what runs it, or what it needs; and nothing is named in vain."""
    told = {part for story in TOLD.STORIES for part in story.parts}
    left, used = [], set()
    for snippet in (each for each in snippets if each.is_block and reading.typed_in(each)):
        used |= {needs(line) for line in lines_of(snippet.text)} - {None}
        place = (snippet.page, snippet.heading)
        kept = replace(snippet, text=runnable(snippet.text))
        if place in TOLD.ELSEWHERE:
            used.add(place)
        elif not told & {place, (snippet.page, None)}:
            left += [f"{kept.place}: {typed.line}" for typed in reading.typed_in(kept)]
    assert left == []
    assert used == {*TOLD.NOT_RUN.values(), *TOLD.ELSEWHERE}


def test_what_is_run_elsewhere_is_there(repository):
    """The tests that are named exist."""
    for path in TOLD.ELSEWHERE.values():
        assert (repository / path).exists(), path


def test_every_heading_of_a_story_has_commands(snippets, reading):
    """So that a heading that was renamed is noticed."""
    for story in TOLD.STORIES:
        for page, heading in story.parts:
            found = [each for each in snippets if each.is_block and is_part(each, page, heading)]
            runs = [each for each in found if reading.typed_in(each) or each.language == "python"]
            assert runs, (page, heading)


@pytest.fixture
def shell(tmp_path, brief_zfcal):
    """Return what runs a text in the folder of a story, as a reader's shell does."""
    folder, words = tmp_path / "here", tmp_path / "bin"
    folder.mkdir()
    words.mkdir()

    def run(text, *, is_brief):
        own = brief_zfcal if is_brief else [sys.executable, "-m", "zfcal_cli.main"]
        (words / "zfcal").write_text(f'#!/bin/sh\nexec {shlex.join(own)} "$@"\n', encoding="utf-8")
        (words / "zfcal").chmod(0o755)
        path = f"{words}{os.pathsep}{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        return subprocess.run(
            ["bash", "-euo", "pipefail", "-c", text],
            cwd=folder,
            env={**os.environ, "PATH": path},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )

    run.folder = folder
    return run


def lines_of(text):
    """Return the lines of a block, each whole."""
    return text.replace("\\\n", " ").splitlines()


def runnable(text):
    """Leave out the lines of a block that need what no test has."""
    return "\n".join(line for line in lines_of(text) if not needs(line))


def changed(text, story, used):
    """Write a block as short as the story says."""
    for old, new in story.changes:
        if re.search(rf"{re.escape(old)}$", text, re.MULTILINE):
            used.add(old)
            text = re.sub(rf"{re.escape(old)}$", new, text, flags=re.MULTILINE)
    return text


NUMBER = re.compile(r"\d+\.\d+")


def is_said(shown, line, most_apart):
    """Say whether a line is the one shown; an ellipsis stands for anything."""
    words, found = NUMBER.split(shown), NUMBER.findall(line)
    pattern = NUMBER.pattern.join(".*".join(map(re.escape, word.split("..."))) for word in words)
    if not re.fullmatch(pattern, line):
        return False
    pairs = zip(NUMBER.findall(shown), found, strict=False)
    return all(float(one) == pytest.approx(float(other), abs=most_apart) for one, other in pairs)


def test_lines_are_compared_as_people_do():
    """Hundredths aside, and what an ellipsis leaves out."""
    assert is_said("S 0.890, ceiling 0.916", "S 0.885, ceiling 0.916", 0.03)
    assert not is_said("S 0.890, ceiling 0.916", "S 0.790, ceiling 0.916", 0.03)
    assert is_said("S 0.890, ceiling 0.916", "S 0.790, ceiling 0.916", 0.15)
    assert is_said("analyse: 8 made, ...", "analyse: 8 made, 0 up to date.", 0.03)
    assert not is_said("analyse: 8 made", "analyse: 9 made", 0.15)


def check_output(shown, said, place, most_apart):
    """Every line that a page shows was said."""
    lines = said.splitlines()
    for line in shown.splitlines():
        found = any(is_said(line, each, most_apart) for each in lines)
        assert found, f"{place}: {line!r}\n{said}"


@pytest.mark.slow
@pytest.mark.parametrize("story", CASES)
def test_a_story(story, snippets, reading, shell, repository, request):
    """Each command ends well, in the order of the page, and says what the page shows."""
    folder = shell.folder
    story.prepare(folder, repository)
    assert shell(story.before, is_brief=True).returncode == 0
    if story.recording:
        source = request.getfixturevalue("recording")(story.recording.partition("/")[0])
        TOLD.unpack(source / story.recording.partition("/")[2], folder)
    is_brief = not any("tutorials" in page for page, _ in story.parts)
    parts = [each for part in story.parts for each in snippets if is_part(each, *part)]
    said, used, named = "", set(), None
    for snippet in parts:
        if not snippet.is_block:
            named = snippet.text if snippet.text.endswith(".geojson") else named
        elif snippet.language == "json":
            (folder / named).write_text(snippet.text, encoding="utf-8")
        elif snippet.language == "text":
            check_output(snippet.text, said, snippet.place, story.most_apart)
        elif snippet.language == "python" and ">>>" not in snippet.text:
            said = run_python(shell, snippet, changed(snippet.text, story, used))
        elif reading.typed_in(snippet) or snippet.text.startswith("cp "):
            text = changed(runnable(snippet.text), story, used)
            done = shell(text, is_brief=is_brief)
            assert done.returncode == 0, f"{snippet.place}\n{text}\n{done.stdout}"
            assert "Traceback" not in done.stdout
            said = done.stdout
    assert used == {old for old, _ in story.changes}


def run_python(shell, snippet, text):
    """Run a block of Python in the folder of a story; the page has imported zfcal before."""
    (shell.folder / "snippet.py").write_text(f"import zfcal\n{text}", encoding="utf-8")
    done = shell("MPLBACKEND=agg python snippet.py", is_brief=True)
    assert done.returncode == 0, f"{snippet.place}\n{done.stdout}"
    return done.stdout


EXPORTED = {
    "csv": "out/tracks.csv",
    "deeplabcut": "out/tracksDLC_zfcal.h5",
    "idtracker": "out/trajectories.npy",
    "movement": "out/tracks.nc",
    "sleap": "out/tracks.analysis.h5",
    "trex": "out",
}
"""What an export writes: of TRex a folder."""


@pytest.mark.slow
@pytest.mark.parametrize("program", EXPORTED)
def test_the_import_of_each_program_reads_its_file(program, snippets, shell, repository):
    """The row of the page reads what `zfcal export` writes for it."""
    rows = [each.text for each in snippets if each.page.endswith("import.md") and not each.is_block]
    line = next(each for each in rows if f"--format {program}" in each and "--columns" not in each)
    if program == "trex":  # the sample's tank does not begin at the corner of its outline
        line = line.replace("--origin 0,100", "--origin -5.1,94.9")
    scale = "--mm-per-px 0.5 --origin 0,1000" if "--mm-per-px" in line else ""
    TOLD.copies(shell.folder, repository, "sample")
    lines = (
        f"zfcal export sample --to {program} {scale} -o out",
        f"mv {EXPORTED[program]} {line.split()[2]}",
        "zfcal init shoal --arena two-rooms --fish 4 --robot --fps 5",
        line,
    )
    done = shell("\n".join(lines), is_brief=True)
    assert done.returncode == 0, done.stdout
    made, truth = (
        read_tracks(shell.folder / name / "tracks" / "000060.parquet")
        for name in ("shoal", "sample")
    )
    moved_m = np.array([made.x_m.mean() - truth.x_m.mean(), made.y_m.mean() - truth.y_m.mean()])
    assert len(made) == len(truth)
    assert np.all(np.abs(moved_m) < 1e-4)
