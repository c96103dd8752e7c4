"""Who hears what happens: whoever is given, or warnings and the log."""

import logging
import subprocess
import sys
import warnings
from pathlib import Path

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


def test_each_call_warns_once_where_it_stands(damaged):
    """With Python's usual filters: the second call as the first, of each file one line."""
    code = (
        "import zfcal\n"
        "for _ in range(2):\n"
        "    zfcal.analyse('trial', force=True)\n"
        "zfcal.report('trial')\n"
    )
    Path("script.py").write_text(code)
    done = subprocess.run([sys.executable, "script.py"], capture_output=True, text=True, check=True)
    lines = [line for line in done.stderr.splitlines() if "ZfcalWarning" in line]
    of_file = [line for line in lines if damaged in line]
    places = [line.partition(": ZfcalWarning")[0].rpartition("/")[2] for line in of_file]
    assert places == ["script.py:3", "script.py:3", "script.py:4"]
    assert len(lines) == len(of_file)


@pytest.mark.parametrize("call", [zfcal.analyse, zfcal.report])
def test_warnings_can_be_refused_or_hidden_by_their_kind(damaged, call):
    """Also of a function that is a package; a filter of one's own comes first."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", zfcal.ZfcalWarning)
        call("trial", force=True)
        warnings.simplefilter("error", zfcal.ZfcalWarning)
        with pytest.raises(zfcal.ZfcalWarning, match=damaged):
            call("trial", force=True)


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
