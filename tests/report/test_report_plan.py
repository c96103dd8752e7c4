"""What a dry run says of a report: the files that would be made."""

import pytest

from zfcal.errors import InputError
from zfcal.report.options import Printing, ReportOptions
from zfcal.report.page import report_plan, write_report

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_model", "quick_pictures")]


@pytest.mark.parametrize("film", [None, "gif"])
def test_a_plan_names_the_files_that_are_made(small_trial, film, tmp_path):
    """In their order, in each format, with a film; nothing is written."""
    how = ReportOptions(printing=Printing(formats=("png", "svg")), film=film)
    roots = [small_trial()]
    planned = report_plan(roots, how=how)
    assert not (roots[0] / "report").exists()
    assert planned == write_report(roots, how=how)

    roots.append(small_trial("b"))
    planned = report_plan(roots, tmp_path / "both")
    assert planned == write_report(roots, tmp_path / "both")


def test_a_plan_is_refused_as_the_report_would_be(small_trial, tmp_path):
    """A film is of one trial."""
    roots = [small_trial(), small_trial("b")]
    with pytest.raises(InputError, match="A film is of one trial, got 2"):
        report_plan(roots, tmp_path / "both", how=ReportOptions(film="gif"))
