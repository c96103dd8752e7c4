"""Pickles: plain data pass, everything that could run is refused before it does."""

import io
import os
import pickle
from pathlib import Path

import numpy as np
import pytest

from zfcal.errors import InputError
from zfcal.readers.pickles import load_plain, read_npy

HERE = Path("tracks.npy")

PLAIN = {
    "trajectories": np.arange(12.0).reshape(3, 2, 2),
    "columns first": np.asfortranarray(np.arange(6).reshape(2, 3)),
    "big-endian": np.arange(3, dtype=">i4"),
    "flags": np.array([True, False]),
    "nothing": np.empty((0, 3)),
    "names": np.array(["ab", "c"]),
    "rate": 28,
    "length": np.float64(58.0),
    "path": "/home/somebody/video.avi",
    "points": {"border": np.array([[1, 2], [3, 4]])},
    "list": [1, 2.5, None, True, b"raw", ("a", "b")],
}


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_plain_data_come_back_as_they_were(protocol):
    """Arrays, numbers, strings, lists and dictionaries, in every protocol of pickle."""
    found = load_plain(HERE, pickle.dumps(PLAIN, protocol=protocol))

    assert found["list"] == PLAIN["list"]
    assert (found["rate"], found["length"], found["path"]) == (28, 58.0, PLAIN["path"])
    assert found["points"]["border"].tolist() == [[1, 2], [3, 4]]
    for name in ("trajectories", "columns first", "big-endian", "flags", "nothing", "names"):
        np.testing.assert_array_equal(found[name], PLAIN[name])
        assert found[name].dtype == PLAIN[name].dtype


def test_what_numpy_saves_is_read_like_numpy_reads_it(tmp_path):
    """A dictionary in a .npy file, without allow_pickle."""
    path = tmp_path / "tracks.npy"
    np.save(path, PLAIN, allow_pickle=True)

    found = read_npy(path)

    np.testing.assert_array_equal(
        found["trajectories"], np.load(path, allow_pickle=True).item()["trajectories"]
    )


def test_an_array_of_numbers_needs_no_pickle(tmp_path):
    """It is read as it is."""
    path = tmp_path / "tracks.npy"
    np.save(path, PLAIN["trajectories"])

    np.testing.assert_array_equal(read_npy(path), PLAIN["trajectories"])


class _Runs:
    """Pickled as a call of any function with any arguments."""

    def __init__(self, function, *arguments):
        self.call = function, arguments

    def __reduce__(self):
        return self.call


def _hostile(marker):
    """Return objects that would leave a file behind if anything of them ran."""
    return {
        "a command": _Runs(os.system, f"touch {marker}"),
        "a program": _Runs(exec, f"open({str(marker)!r}, 'w').close()"),
        "an expression": _Runs(eval, f"open({str(marker)!r}, 'w').close()"),
        "a module": _Runs(__import__, "antigravity"),
        "an attribute": _Runs(getattr, os, "system") if False else _Runs(getattr, "", "format"),
        "a file": _Runs(open, str(marker), "w"),
        "a constructor": io.BytesIO(b""),
        "an own class": Path("x"),
        "numpy's own door": _Runs(np.load, str(marker)),
        "a set": {1, 2},
        "a complex number": 1j,
        "an array of records": np.zeros(2, dtype=[("a", "f8"), ("b", "O")]),
        "dates": np.array(["2020-01-01"], dtype="datetime64[D]"),
    }


@pytest.mark.parametrize("wrapped", [False, True])
@pytest.mark.parametrize("what", _hostile("x"))
def test_a_pickle_that_asks_for_more_is_refused_and_nothing_runs(what, wrapped, tmp_path):
    """Alone, or hidden in an object array of a dictionary, as in a file of tracks."""
    marker = tmp_path / "it-ran"
    thing = _hostile(marker)[what]
    path = tmp_path / "tracks.npy"
    found = np.empty((), dtype=object)
    found[()] = {"trajectories": np.zeros((1, 1, 2)), "extra": thing} if wrapped else thing
    np.save(path, found, allow_pickle=True)

    with pytest.raises(InputError) as caught:
        read_npy(path)

    assert not marker.exists()
    assert str(path) in str(caught.value)
    assert "expected arrays, dictionaries, lists, numbers and strings only; it " in str(
        caught.value
    )
    assert "A pickle can run programs" in caught.value.hint


def test_the_refused_wish_is_named(tmp_path):
    """So that a person can tell an attack from a tracker's own class."""
    with pytest.raises(InputError, match=r"it refers to (posix|nt)\.system"):
        load_plain(HERE, pickle.dumps(_Runs(os.system, "true")))


def test_bytes_are_never_taken_for_addresses():
    """An array of objects whose data are bytes: numpy would take them for pointers."""
    crafted = (
        b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntR"
        b"(I1\n(I1\ntcnumpy\ndtype\n(S'O8'\nI0\nI1\ntR(I3\nS'|'\nNNNI-1\nI-1\nI0\ntb"
        b"I00\nS'AAAAAAAA'\ntb."
    )

    with pytest.raises(InputError, match="takes bytes for objects"):
        load_plain(HERE, crafted)


def test_attributes_of_the_reader_cannot_be_set():
    """The BUILD opcode may carry values to set on whatever was named before."""
    crafted = b"\x80\x02cnumpy\ndtype\nN}X\x04\x00\x00\x00nameK\x01s\x86b."

    with pytest.raises(InputError):
        load_plain(HERE, crafted)

    test_plain_data_come_back_as_they_were(2)


def test_an_encoding_other_than_the_usual_one_is_refused():
    """_codecs.encode is admitted for bytes alone: other encodings unpack and transform."""
    crafted = b"c_codecs\nencode\n(Vabc\nVrot13\ntR."

    with pytest.raises(InputError, match="has the encoding 'rot13'"):
        load_plain(HERE, crafted)


def test_a_pickle_that_doubles_itself_takes_no_time():
    """Sixty lists, each twice in the next: 2^60 items if they were built one by one."""
    nested = [0]
    for _ in range(60):
        nested = [nested, nested]

    assert len(load_plain(HERE, pickle.dumps(nested))) == 2


def test_a_list_that_holds_itself_ends():
    """It cannot be made plain, but must not hang."""
    loop = [1]
    loop.append(loop)

    assert load_plain(HERE, pickle.dumps(loop)) == [1, None]


def test_a_pickle_nested_too_deeply_is_an_input_error():
    """Deeper than Python's stack."""
    with pytest.raises(InputError, match="expected a whole pickled file"):
        load_plain(HERE, b"(l" * 100_000 + b"a" * 99_999 + b".")


@pytest.mark.parametrize("length", [0, 1, 5, 50, 200])
def test_half_a_pickle_is_an_input_error(length):
    """Cut anywhere."""
    with pytest.raises(InputError):
        load_plain(HERE, pickle.dumps(PLAIN)[:length])


def test_data_of_another_size_than_the_shape_are_an_input_error():
    """Four numbers cannot fill five places."""
    whole = pickle.dumps(np.arange(4.0), protocol=2)
    assert b"K\x04\x85" in whole

    with pytest.raises(InputError, match="cannot reshape array of size 4"):
        load_plain(HERE, whole.replace(b"K\x04\x85", b"K\x05\x85"))
