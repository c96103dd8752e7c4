"""Who hears what happens: whoever is given, or warnings and the log."""

import logging
import warnings

import pytest

import zfcal
from zfcal.stages.events import LeftOut


@pytest.fixture
def damaged(here):
    """Damage a segment of the trial's tracks."""
    path = here / "trial" / "tracks" / "000060.parquet"
    path.write_bytes(b"PAR1")
    return path.name


def test_what_is_left_out_is_a_warning(damaged):
    """With the file and what to do; the rest is made."""
    with pytest.warns(UserWarning, match=damaged) as caught:
        zfcal.analyse("trial", force=True)
    assert len(caught) >= 1


def test_who_hears_of_it_needs_no_warning(damaged):
    """The events of the stages, as they are."""
    heard = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        zfcal.analyse("trial", force=True, tell=heard.append)
    assert any(damaged in event.problem for event in heard if isinstance(event, LeftOut))


def test_what_is_made_or_would_be_is_logged(here, caplog):
    """Nothing is printed."""
    with caplog.at_level(logging.INFO, logger="zfcal"):
        zfcal.analyse("trial", features="residence", dry_run=True)
        zfcal.analyse("trial", features="residence")
    texts = [record.getMessage() for record in caplog.records]
    assert any(text.startswith("would make trial/stats/000120.parquet") for text in texts)
    assert any(text.startswith("trial/stats/000120.parquet: made") for text in texts)
