"""The tree of errors: what they say, what they advise, how the command ends."""

from __future__ import annotations

import traceback
from pathlib import Path

import pytest

from zfcal import errors
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
    kinds = {kind for kind in made if issubclass(kind, Exception)}

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
