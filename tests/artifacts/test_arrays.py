"""Arrow arrays made without pandas are those that pyarrow makes."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from zfcal.artifacts.arrays import array_of, dictionary_of, numbers_of

NUMBERS = (pa.float64(), pa.float32(), pa.int64(), pa.int32(), pa.int8())
NAN = float("nan")


@pytest.mark.parametrize("kind", NUMBERS)
@pytest.mark.parametrize("values", [[], [1, 2, 3], [None, 1], [None, None], (5,)])
def test_numbers_are_as_pyarrow_has_them(kind, values):
    """With nulls and without, from a list and from an array."""
    made = array_of(values, kind)
    made.validate(full=True)
    assert made.equals(pa.array(values, type=kind))
    if None not in values:
        plain = np.array(values, dtype=kind.to_pandas_dtype())
        assert array_of(plain, kind).equals(pa.array(plain))


@pytest.mark.parametrize("nan_is_null", [False, True])
@pytest.mark.parametrize("values", [[1.5, NAN, None, -0.0], np.array([NAN, 2.0, np.inf])])
def test_nan_is_null_only_if_asked_for(values, nan_is_null):
    """NaN is a number unless a column says otherwise; None is null in any case."""
    made = array_of(values, pa.float64(), nan_is_null=nan_is_null)
    made.validate(full=True)
    expected = pa.array(values, type=pa.float64(), from_pandas=nan_is_null)
    assert str(made) == str(expected)
    assert made.null_count == expected.null_count


@pytest.mark.parametrize(
    "values", [[], [[]], [[1.0, NAN], [], [2]], ((0.5,), [3.0, -0.0]), [[None, 1.0]]]
)
def test_lists_are_as_pyarrow_has_them(values):
    """A list of numbers per row, of any length, empty ones among them."""
    kind = pa.list_(pa.float64())
    made = array_of(values, kind)
    made.validate(full=True)
    assert str(made) == str(pa.array(values, type=kind))
    assert made.type == kind


@pytest.mark.parametrize("values", [[None, [1.0]], [np.array([1.0, 2.0])], [[np.float64(1.5)]]])
def test_lists_of_other_things_go_the_usual_way(values):
    """A row that is null, rows that are arrays, numbers of NumPy."""
    kind = pa.list_(pa.float64())
    assert array_of(values, kind).equals(pa.array(values, type=kind))


def test_values_that_need_converting_go_the_usual_way():
    """An int64 array into int32, every other row, numbers of NumPy in a list."""
    wide = np.arange(6)
    assert array_of(wide, pa.int32()).equals(pa.array(wide, type=pa.int32()))
    assert array_of(wide[::2], pa.int64()).to_pylist() == [0, 2, 4]
    assert array_of([np.float64(1.5), 2], pa.float64()).to_pylist() == [1.5, 2.0]
    assert array_of([[1.0], []], pa.list_(pa.float64())).to_pylist() == [[1.0], []]


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        (["x"], pa.float64()),
        ([2**40], pa.int32()),
        (np.array([2**40]), pa.int32()),
        ([1], pa.string()),
        ([True, "a"], pa.string()),
        ([["x"]], pa.list_(pa.float64())),
    ],
)
def test_what_is_not_of_the_type_is_refused(values, kind):
    """Nothing is parsed, spelled out or wrapped round."""
    with pytest.raises((pa.ArrowException, ValueError, TypeError, OverflowError)):
        array_of(values, kind)


@pytest.mark.parametrize("words", [[], ["a", None, "Größe", ""], [None], ["same", "same"]])
def test_strings_are_as_pyarrow_has_them(words):
    """Letters of several bytes, nothing at all, and null, which is not nothing."""
    made = array_of(words, pa.string())
    made.validate(full=True)
    assert made.equals(pa.array(words, type=pa.string()))


def test_a_dictionary_keeps_the_order_in_which_its_words_are_known():
    """Codes are places in the list, whatever comes first in the column."""
    made = dictionary_of(["robot", None, "fish"], ("fish", "robot"))
    assert made.type == pa.dictionary(pa.int8(), pa.string())
    assert made.indices.to_pylist() == [1, None, 0]
    assert made.dictionary.to_pylist() == ["fish", "robot"]


def test_an_unknown_word_is_named():
    """The message says what was found and what is known."""
    with pytest.raises(ValueError, match=r"'shark' is none of fish, robot"):
        dictionary_of(np.array(["fish", "shark"], dtype=object), ("fish", "robot"))


@pytest.mark.parametrize("kind", NUMBERS)
def test_numbers_come_back(kind):
    """From one array, a slice of one, several chunks, none."""
    whole = pa.array([1, 2, 3, 4], type=kind)
    for values in (whole, whole[1:3], pa.chunked_array([whole, whole[2:]]), whole[:0]):
        back = numbers_of(values)
        assert back.dtype == kind.to_pandas_dtype()
        assert back.tolist() == values.to_pylist()
    assert numbers_of(pa.chunked_array([], type=kind)).shape == (0,)


def test_nulls_come_back_as_nan():
    """As pyarrow has it."""
    back = numbers_of(pa.array([1.0, None]))
    assert back[0] == 1.0
    assert np.isnan(back[1])


def test_reading_and_writing_a_table_loads_no_pandas(tmp_path):
    """It would double the time of a short command."""
    script = """
import sys
from pathlib import Path
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.tables import make_table, read_table, write_table
scores = {"window_end_s": [120], "compared": ["robot-vs-fish"], "feature": ["S"], "zone": [None],
          "value": [0.5], "low": [None], "high": [None], "ceiling": [None], "n_windows": [None],
          "n_features": [4]}
path = Path(sys.argv[1])
lineage = Lineage(schema="zfcal.scores/1", command="analyse")
write_table(path, make_table("zfcal.scores/1", scores), lineage)
read_table(path, "zfcal.scores/1")
sys.exit("pandas" in sys.modules)
"""
    subprocess.run([sys.executable, "-c", script, str(tmp_path / "a.parquet")], check=True)


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="counts as Linux does")
def test_reading_a_table_starts_no_thread(tmp_path):
    """One that is just starting aborts a process that ends: one command in a hundred."""
    script = """
import os, sys
from pathlib import Path
import pyarrow as pa, pyarrow.parquet as pq
from zfcal.artifacts.tables import read_parquet
pq.write_table(pa.table({"x": [1.0]}), sys.argv[1], write_page_checksum=True)
before = len(os.listdir("/proc/self/task"))
read_parquet(Path(sys.argv[1]), "")
sys.exit(len(os.listdir("/proc/self/task")) - before)
"""
    subprocess.run([sys.executable, "-c", script, str(tmp_path / "a.parquet")], check=True)
