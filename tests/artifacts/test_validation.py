"""Documents at the door: what is wrong, where, what was expected and what was got."""

import pytest

from zfcal.artifacts.validation import (
    check,
    descriptions_of,
    nearest,
    read_json,
    read_toml,
    written_by_people,
)
from zfcal.errors import DamagedError, InputError, SchemaError

SETTINGS = {
    "schema": "zfcal.trial/1",
    "arena": "two-rooms",
    "n_fish": 4,
    "n_robots": 1,
    "fps": 15.0,
    "dt_s": 0.2,
    "seed": 1,
}


def test_a_sound_document_passes():
    """Nothing is returned, nothing is raised."""
    check(SETTINGS, "trial", "trial.toml")


def test_an_unknown_key_is_named_with_the_nearest_known_one():
    """The key, the file, and what was probably meant."""
    settings = {("n_fihs" if key == "n_fish" else key): value for key, value in SETTINGS.items()}

    with pytest.raises(InputError) as caught:
        check(settings, "trial", "a/trial.toml")
    assert str(caught.value) == "a/trial.toml: unknown key 'n_fihs' (and 1 more)."
    assert caught.value.hint.startswith("Did you mean 'n_fish'? Known keys: schema, arena")


def test_a_key_like_no_other_gets_no_guess():
    """Only the list of those that there are."""
    with pytest.raises(InputError) as caught:
        check({**SETTINGS, "zzz": 1}, "trial", "trial.toml")
    assert caught.value.hint.startswith("Known keys:")


def test_a_value_that_is_none_of_those_known_is_named_with_the_nearest():
    """Of a word; a number is like none."""
    lens = {"matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "distortion": []}
    camera = {"schema": "zfcal.camera/1", "size_px": [640, 480], "lens": lens}
    says = 'one of "pinhole", "fisheye", "homography", got "fisheyes"'

    with pytest.raises(InputError, match=says) as caught:
        check({**camera, "model": "fisheyes"}, "camera", "below.toml")
    assert caught.value.hint.startswith("Did you mean 'fisheye'? model: pinhole")
    with pytest.raises(InputError, match="got 3") as caught:
        check({**camera, "model": 3}, "camera", "below.toml")
    assert caught.value.hint.startswith("model: pinhole")


def test_a_missing_key_is_explained():
    """With what it means."""
    settings = {key: value for key, value in SETTINGS.items() if key != "dt_s"}

    with pytest.raises(InputError, match="'dt_s' is missing") as caught:
        check(settings, "trial", "trial.toml")
    assert caught.value.hint == ("dt_s: Step of the model, in seconds: a whole number of frames.")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"fps": -1}, "fps must be more than 0, got -1"),
        ({"fps": "15"}, 'fps must be a number, got "15"'),
        ({"n_fish": True}, "n_fish must be a whole number, got true"),
        ({"n_fish": 1.5}, "n_fish must be a whole number, got 1.5"),
        ({"n_fish": 3.0}, "n_fish must be a whole number, got 3.0"),
        ({"n_fish": 1e308}, "n_fish must be a whole number, got 1e+308"),
        ({"n_robots": 10**18}, "n_robots must be at most 10000, got 1000000000000000000"),
        ({"n_fish": -1}, "n_fish must be at least 0, got -1"),
        ({"arena": ""}, 'arena must be a text that is not empty, got ""'),
        ({"cameras": {"top": {}}}, "unknown key 'top' in cameras"),
        ({"cameras": {"below": {"fil": "x"}}}, "unknown key 'fil' in cameras.below"),
        ({"cameras": {"below": {"file": 1}}}, "cameras.below.file must be text in quotes, got 1"),
        ({"source": ["x" * 100]}, '["' + "x" * 58 + " ..."),
    ],
)
def test_a_wrong_value_is_named_with_its_place(change, says):
    """Where, what was expected, what was got; long values are cut."""
    with pytest.raises(InputError) as caught:
        check({**SETTINGS, **change}, "trial", "trial.toml")
    assert says in str(caught.value)


@pytest.mark.parametrize("found", ["zfcal.trial/2", "zfcal.model/1", 7])
def test_another_schema_is_told_before_anything_else(found):
    """A newer file may well have keys that this version does not know."""
    with pytest.raises(SchemaError, match=f"{found}.*expected 'zfcal.trial/1'"):
        check({"schema": found, "new_key": 1}, "trial", "trial.toml")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a = \n", "is not valid TOML: .*line 1"),
        ("a = 1\na = 2\n", "is not valid TOML"),
        ("", "the file is empty"),
        ("\n \n", "the file is empty"),
        ("\0" * 100, "the file is empty"),
    ],
)
def test_text_that_is_no_toml_is_damage(tmp_path, text, says):
    """With the place; zeros are what a lost power leaves."""
    path = tmp_path / "x.toml"
    path.write_text(text)

    with pytest.raises(DamagedError, match=says) as caught:
        read_toml(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b'{"a": 1', "is not valid JSON: .*line 1"),
        (b"[1, 2]", "expected an object in braces, got"),
        (b'{"a": NaN}', "NaN is not a number in JSON"),
        (b'{"a": -Infinity}', "-Infinity is not a number"),
        (b"\xff\xfe\x00", "no UTF-8 text"),
        (b"[" * 100_000, "nests deeper than 100"),
        (b"", "the file is empty"),
    ],
)
def test_text_that_is_no_json_is_damage(tmp_path, content, says):
    """Never a traceback."""
    path = tmp_path / "x.json"
    path.write_bytes(content)

    with pytest.raises(DamagedError, match=says):
        read_json(path)


def test_a_byte_order_mark_is_no_damage(tmp_path):
    """Some editors write one at the start."""
    path = tmp_path / "x.json"
    path.write_bytes(b'\xef\xbb\xbf{"a": 1}')

    assert read_json(path) == {"a": 1}


@pytest.mark.parametrize("reader", [read_toml, read_json])
def test_a_missing_file_is_an_input_error(tmp_path, reader):
    """And so is a folder."""
    with pytest.raises(InputError, match="no such file"):
        reader(tmp_path / "x")
    with pytest.raises(InputError, match="cannot be read"):
        reader(tmp_path)


def test_damage_of_a_file_that_people_edit_is_their_mistake(tmp_path):
    """It stops the command, while a damaged artifact is left out."""
    path = tmp_path / "x.toml"
    path.write_text("a = ")

    with pytest.raises(InputError, match="not valid TOML") as caught, written_by_people():
        read_toml(path)
    assert caught.value.exit_code == 1


def test_every_setting_has_a_description():
    """It becomes the comment in trial.toml."""
    for part in ("", "camera"):
        assert all(descriptions_of("trial", part).values())


def test_the_nearest_word_is_near():
    """Or there is none."""
    assert nearest("two-room", ["ring", "two-rooms"]) == "Did you mean 'two-rooms'? "
    assert nearest("xyz", ["ring", "two-rooms"]) == ""
