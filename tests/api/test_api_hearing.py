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
    with pytest.warns(zfcal.ZfcalWarning, match=damaged) as caught:
        zfcal.analyse("trial", force=True)
    assert len(caught) >= 1


@pytest.mark.parametrize("function", [zfcal.analyse, zfcal.diagnose])
def test_each_call_warns_where_it_stands(damaged, function):
    """The second call as the first, each text once in a call; also of a package."""
    found = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for _ in range(2):
            function("trial", dry_run=True)
            found.append([(str(each.message), each.category, each.filename) for each in caught])
            caught.clear()
    assert found[0] == found[1]
    assert len(set(found[0])) == len(found[0]) >= 1
    assert {(kind, file) for _, kind, file in found[0]} == {(zfcal.ZfcalWarning, __file__)}
    assert any(damaged in text for text, _, _ in found[0])


def test_warnings_can_be_refused_or_hidden_by_their_kind(damaged):
    """A filter of one's own comes first."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", zfcal.ZfcalWarning)
        zfcal.analyse("trial", dry_run=True)
        warnings.simplefilter("error", zfcal.ZfcalWarning)
        with pytest.raises(zfcal.ZfcalWarning, match=damaged):
            zfcal.analyse("trial", dry_run=True)


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
