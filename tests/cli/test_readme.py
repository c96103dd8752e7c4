"""What the README and the samples promise."""

import re
import shutil

import pytest


@pytest.fixture(scope="module")
def readme(repository):
    """Return the README."""
    return (repository / "README.md").read_text(encoding="utf-8")


def commands_of(text, heading):
    """Return the first block of commands under a heading."""
    section = text.partition(f"\n## {heading}")[2].partition("\n## ")[0]
    block = re.search(r"\n\n((?:    \S.*\n)+)", section).group(1)
    return [line.strip() for line in block.splitlines()]


def test_the_five_commands_run_on_the_samples(zfcal, readme, repository, tmp_path):
    """As they stand, but for the budget, which is shortened, and each in turn ends with 0."""
    lines = commands_of(readme, "Five commands on the sample")
    assert [line.split()[1] for line in lines] == [
        "init",
        "import",
        "analyse",
        "calibrate",
        "report",
    ]
    shutil.copytree(repository / "data-samples", tmp_path / "data-samples")
    for line in lines:
        done = zfcal(*line.replace("--budget 20s", "--budget 1s").split()[1:], "-q")
        assert done.code == 0, (line, done.err)
    assert (tmp_path / "trial" / "report" / "index.html").exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two-rooms", "ring"])
def test_the_samples_are_sound_trials(zfcal, repository, tmp_path, name):
    """Whole, valid, and they can be analysed."""
    shutil.copytree(repository / "data-samples" / name, tmp_path / name)
    assert zfcal("check", name).code == 0
    done = zfcal("analyse", name)
    assert done.code == 0
    assert len(done.lines) >= 8


def test_links_lead_somewhere(readme, repository):
    """Every file that the README names in a link or as a picture is there."""
    for target in re.findall(r"\]\(([^)#:]+)\)", readme):
        assert (repository / target).exists(), target


def test_files_of_a_trial_that_the_documents_name_have_the_right_names(repository):
    """Six digits, so that they sort as numbers."""
    for name in ("README.md", "docs/commands.md"):
        text = (repository / name).read_text(encoding="utf-8")
        for number in re.findall(r"(?:tracks|stats|scores|models)/(\d+)", text):
            assert len(number) == 6, (name, number)
