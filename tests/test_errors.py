"""The tree of errors: what they say, what they advise, how the command ends."""

from __future__ import annotations

import importlib
import pickle
import pkgutil
import traceback
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

import zfcal
from zfcal import errors
from zfcal.artifacts.tables import STATS, read_table
from zfcal.errors import (
    ChangedError,
    DamagedError,
    InputError,
    LockedError,
    OptionError,
    SchemaError,
    StorageError,
    TakenError,
    ZfcalError,
)
from zfcal.readers import ImportOptions, read_foreign

SAMPLE = Path(__file__).parents[1] / "data-samples" / "two-rooms"


@pytest.mark.parametrize(
    ("kind", "code"),
    [
        (ZfcalError, 1),
        (InputError, 1),
        (OptionError, 2),
        (StorageError, 1),
        (DamagedError, 3),
        (LockedError, 75),
    ],
)
def test_each_error_has_its_exit_code(kind, code):
    """1 for what a person can mend, 2 for usage, 3 for a file left out, 75 for a lock."""
    assert kind("what").exit_code == code


def test_every_error_of_the_module_is_of_the_tree():
    """One base class catches all; nothing else is caught by it."""
    made = [value for value in vars(errors).values() if isinstance(value, type)]
    warned = {kind for kind in made if issubclass(kind, Warning)}
    kinds = {kind for kind in made if issubclass(kind, Exception)} - warned

    assert kinds == {
        ZfcalError, InputError, OptionError, SchemaError, DamagedError, StorageError, TakenError,
        ChangedError, LockedError,
    }  # fmt: skip
    assert all(issubclass(kind, ZfcalError) for kind in kinds)
    assert not issubclass(OSError, ZfcalError)


def test_the_message_is_the_text_and_the_hint_stands_apart():
    """The command line prints them on lines of their own."""
    error = InputError("fps is 0.", hint="Give a rate in hertz.")

    assert str(error) == "fps is 0."
    assert error.hint == "Give a rate in hertz."
    assert InputError("no hint").hint == ""


def test_python_shows_the_hint_below_the_message():
    """As a note, which tracebacks and notebooks print; without a hint there is none."""
    error = InputError("fps is 0.", hint="Give a rate in hertz.")

    assert traceback.format_exception_only(error) == [
        "zfcal.errors.InputError: fps is 0.\n",
        "hint: Give a rate in hertz.\n",
    ]
    assert len(traceback.format_exception_only(InputError("no hint"))) == 1


def test_a_schema_error_names_the_file_and_both_schemas():
    """What, where, found and expected; it counts as input, hence exit 1."""
    error = SchemaError(Path("a/b.parquet"), found="zfcal.stats/1", wanted="zfcal.tracks/1")

    assert str(error) == "a/b.parquet: schema is 'zfcal.stats/1', expected 'zfcal.tracks/1'."
    assert "zfcal inspect" in error.hint
    assert isinstance(error, InputError)
    assert error.exit_code == 1


def test_a_hint_is_a_keyword():
    """A second positional argument would be taken for a hint by mistake."""
    with pytest.raises(TypeError):
        InputError("what", "hint")


def test_a_hint_that_is_added_later_stands_below_the_message_as_well():
    """One line for the hint that is meant now; notes of others stay."""
    error = InputError("fps is 0.", hint="Give a rate.")
    error.add_note("while reading a.csv")
    error.hint = f"{error.hint} In hertz."

    assert traceback.format_exception_only(error) == [
        "zfcal.errors.InputError: fps is 0.\n",
        "while reading a.csv\n",
        "hint: Give a rate. In hertz.\n",
    ]
    error.hint = ""
    assert len(traceback.format_exception_only(error)) == 2


def test_a_reader_that_knows_more_says_so_in_the_traceback(tmp_path):
    """It adds to the hint of an error on its way."""
    path = tmp_path / "tracks.txt"
    path.write_text("0,1,10,10,5,5,1,-1,-1,-1\n")
    with pytest.raises(ZfcalError) as caught:
        read_foreign(path, "mot", ImportOptions(fps=15.0))

    assert caught.value.hint == "If the file counts frames from 0: --first-frame 0"
    assert f"hint: {caught.value.hint}\n" in traceback.format_exception_only(caught.value)


def whole_tree():
    """Return every error of the package, wherever it is defined."""
    for module in pkgutil.iter_modules(zfcal.__path__, "zfcal."):
        importlib.import_module(module.name)
    importlib.import_module("zfcal.drive.publish")
    found, todo = [], [ZfcalError]
    while todo:
        kind = todo.pop()
        found.append(kind)
        todo += kind.__subclasses__()
    return found


def example(kind):
    """Return an error of a kind, with a hint."""
    if issubclass(kind, SchemaError):
        return kind(Path("a.parquet"), found="zfcal.stats/1", wanted="zfcal.tracks/1")
    return kind("what", hint="do this")


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_every_error_goes_to_another_process_whole(protocol):
    """Its kind, message, hint and the line that tracebacks show."""
    kinds = whole_tree()
    assert len(kinds) >= 10
    for kind in kinds:
        error = example(kind)
        again = pickle.loads(pickle.dumps(error, protocol))
        assert type(again) is kind
        assert (str(again), again.hint) == (str(error), error.hint)
        assert traceback.format_exception_only(again) == traceback.format_exception_only(error)


def test_a_pool_hands_on_a_schema_error():
    """And does not wait for ever for one that cannot be read back."""
    path = min((SAMPLE / "tracks").glob("*.parquet"))
    pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"))
    try:
        found = pool.submit(read_table, path, STATS).exception(timeout=60)
    finally:
        for process in pool._processes.values():
            process.kill()
        pool.shutdown(wait=False)
    assert type(found) is SchemaError
    assert path.name in str(found)
