"""The report of a set beside the pages of its trials: each page keeps its own options."""

import pytest

from zfcal.api.reporting import write_page
from zfcal.artifacts.validation import read_json
from zfcal.report.options import Printing, ReportOptions, report_options_of
from zfcal.report.page import report_options, report_reason
from zfcal.stages.trial_context import Task

pytestmark = pytest.mark.usefixtures("quick_model", "quick_pictures")

PAPER = ReportOptions(printing=Printing(formats=("svg",), width_mm=85.0))


@pytest.fixture
def pair(small_trial):
    """Return two trials; the first has a page."""
    roots = [small_trial("one"), small_trial("two")]
    report(roots[:1])
    return roots


def report(roots, out=None, *, how=None, **task):
    """Write the report of trials, as the command does."""
    write_page(roots, out, lambda _: None, task=Task(**task), how=how or ReportOptions())


def endings(root):
    """Return the endings of the files of a trial's own report."""
    return {path.suffix for path in (root / "report").iterdir()}


def stamps(root):
    """Return when each file of a trial's own report was written."""
    return {path.name: path.stat().st_mtime_ns for path in (root / "report").iterdir()}


@pytest.mark.slow
def test_a_set_of_another_format_leaves_a_page_that_is_up_to_date(pair, tmp_path):
    """Not one file of it is written; the page that was missing has the format of the set."""
    before = stamps(pair[0])

    report(pair, tmp_path / "both", how=PAPER)

    assert stamps(pair[0]) == before
    assert ".svg" not in endings(pair[0])
    assert {path.suffix for path in (tmp_path / "both").iterdir()} >= {".svg", ".html"}
    assert ".png" not in endings(pair[1])
    assert report_options(pair[1]) == PAPER


@pytest.mark.slow
def test_a_page_whose_inputs_have_changed_is_written_in_its_own_format(pair, tmp_path):
    """So is one that is forced."""
    (pair[0] / "tracks" / "000060.parquet").unlink()
    assert report_reason(pair[:1]) is not None

    report(pair, tmp_path / "both", how=PAPER)

    assert report_reason(pair[:1]) is None
    assert ".svg" not in endings(pair[0])
    before = stamps(pair[0])
    report(pair, tmp_path / "both", how=PAPER, force=True)
    assert stamps(pair[0])["index.html"] > before["index.html"]
    assert ".svg" not in endings(pair[0])


@pytest.mark.slow
def test_a_page_without_readable_numbers_is_made_with_the_options_of_the_set(pair, tmp_path):
    """Nobody knows how it was made."""
    (pair[0] / "report" / "integration.json").write_text("{")

    report(pair, tmp_path / "both", how=PAPER)

    assert read_json(pair[0] / "report" / "integration.json")["files"]
    assert ".svg" in endings(pair[0])


@pytest.mark.parametrize("how", [ReportOptions(), PAPER, ReportOptions(published=True, film="gif")])
def test_options_are_read_as_they_were_written(how):
    """From the lineage of a report, whatever else it holds."""
    assert report_options_of({"trials": ["one"], **how.as_lineage()}) == how
