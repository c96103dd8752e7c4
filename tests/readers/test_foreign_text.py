"""Text that unpacks to too much is refused before it is read."""

import gzip
import tracemalloc

import pytest

from zfcal.artifacts.reading.limits import VARIABLE
from zfcal.errors import DamagedError, InputError
from zfcal.readers import ImportOptions, import_foreign, text

LIMIT = 50_000_000


@pytest.fixture
def bomb(tmp_path):
    """Return a file of some 100 kB that unpacks to 100 MB, without a line's end."""
    path = tmp_path / "tracks.csv.gz"
    with gzip.open(path, "wb", compresslevel=9) as file:
        for _ in range(100):
            file.write(b"1" * 10**6)
    assert path.stat().st_size < 200_000
    return path


@pytest.mark.parametrize("name", ["csv", "mot", "idtracker", "deeplabcut"])
def test_compressed_text_is_not_unpacked_beyond_the_limit(bomb, monkeypatch, name):
    """The message says how to raise it, and nothing of that size is ever held."""
    monkeypatch.setattr(text, "TABLE_BYTES", LIMIT)
    tracemalloc.start()
    with pytest.raises(DamagedError, match=r"unpacks to too much \(more than .* at most 50.0 MB"):
        import_foreign(bomb, name, ImportOptions(fps=5.0))
    assert tracemalloc.get_traced_memory()[1] < LIMIT / 2
    tracemalloc.stop()


def test_the_limit_can_be_raised_and_a_line_is_still_no_longer_than_lines_are(bomb, monkeypatch):
    """What passes as to its size is read line by line."""
    monkeypatch.setattr(text, "TABLE_BYTES", LIMIT)
    monkeypatch.setenv(VARIABLE, "200")
    with pytest.raises(InputError, match="expected lines of text, got one of more than"):
        import_foreign(bomb, "csv", ImportOptions(fps=5.0))


def test_a_damaged_archive_is_named_as_such(tmp_path):
    """It is not taken for one that is too large."""
    path = tmp_path / "tracks.csv.gz"
    rows = b"".join(b"%d,1,0.1,0.2\n" % second for second in range(1000))
    path.write_bytes(gzip.compress(b"time_s,agent,x_m,y_m\n" + rows)[:-20])
    with pytest.raises(InputError, match="cannot be read"):
        import_foreign(path, "csv", ImportOptions(fps=5.0))
