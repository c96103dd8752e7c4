"""trial.toml is written for people, and read with care."""

import dataclasses

import pytest

from zfcal.artifacts.settings import find_trial, read_trial, write_trial
from zfcal.errors import InputError, SchemaError


@pytest.fixture
def settings(trial):
    """Return the path of a sound trial.toml."""
    return trial.config


def edit(path, old, new):
    """Replace a piece of a file as an editor would."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_settings_come_back_as_they_were(trial):
    """Every field, also the cameras."""
    with_cameras = dataclasses.replace(
        trial,
        source='recorded on "day 3"\nby Ünal',
        cameras={"below": {"source": "/dev/video1"}, "overhead": {"file": "c.toml", "source": "0"}},
    )
    for settings in (trial, with_cameras):
        write_trial(settings)
        assert read_trial(trial.root) == settings


def test_every_key_stands_under_a_comment(trial):
    """People edit this file."""
    cameras = {"overhead": {"file": "c.toml", "source": "0"}}
    write_trial(dataclasses.replace(trial, cameras=cameras))
    lines = trial.config.read_text().splitlines()

    keys = [number for number, line in enumerate(lines) if " = " in line and line[0] != "#"]
    assert len(keys) == 11
    assert all(lines[number - 1].startswith("# ") for number in keys)
    assert max(map(len, lines)) <= 80


def test_equal_settings_make_equal_bytes(trial):
    """Written twice, the file does not change."""
    before = trial.config.read_bytes()
    write_trial(read_trial(trial.root))

    assert trial.config.read_bytes() == before


def test_a_whole_number_serves_as_a_rate(trial, settings):
    """People write fps = 15."""
    edit(settings, "fps = 15.0", "fps = 15")

    assert read_trial(trial.root).fps == 15.0
    assert isinstance(read_trial(trial.root).fps, float)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("n_fish", "n_fihs", "unknown key 'n_fihs'"),
        ("seed = 7", "", "'seed' is missing"),
        ("seed = 7", "seed = 7.5", "seed must be a whole number, got 7.5"),
        ("seed = 7", "seed = -7", "seed must be at least 0"),
        ("dt_s = 0.2", "dt_s = 400.0", "dt_s must be at most 2, got 400.0"),
        ("seed = 7", f"seed = {2**63}", "seed must be at most 9223372036854775807"),
        ("fps = 15.0", "fps = nan", "fps must be a positive rate"),
        ("fps = 15.0", "fps = inf", "fps must be a positive rate"),
        ("fps = 15.0", "fps = 14.0", "dt_s must be a whole number of frames"),
        ("n_fish = 2", "n_fish = 0\nn_robot = 1", "unknown key 'n_robot'"),
        ("seed = 7", "seed 7", "is not valid TOML"),
    ],
)
def test_a_wrong_setting_is_named_with_its_file(trial, settings, old, new, says):
    """One line, exit code 1."""
    edit(settings, old, new)

    with pytest.raises(InputError, match=says) as caught:
        read_trial(trial.root)
    assert str(settings) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 1


def test_settings_of_a_later_version_are_refused(trial, settings):
    """Rather than half understood."""
    edit(settings, "zfcal.trial/1", "zfcal.trial/2")

    with pytest.raises(SchemaError, match=r"expected 'zfcal\.trial/1'"):
        read_trial(trial.root)


def test_wrong_settings_are_not_written(trial):
    """What was there stays."""
    before = trial.config.read_bytes()

    with pytest.raises(InputError, match="arena must be a text that is not empty"):
        write_trial(dataclasses.replace(trial, arena=""))
    assert trial.config.read_bytes() == before


def test_a_folder_without_settings_is_no_trial(tmp_path):
    """The hint says how to make one."""
    with pytest.raises(InputError, match="is not a trial") as caught:
        read_trial(tmp_path)
    assert "zfcal init" in caught.value.hint


def test_a_trial_is_found_from_itself_and_from_anything_in_it(trial):
    """Paths of artifacts come through pipes."""
    assert find_trial(trial.root) == trial.root
    assert find_trial(trial.root / "tracks" / "000000.parquet") == trial.root
    assert find_trial(trial.root / "tracks") == trial.root


def test_a_relative_path_finds_its_trial(trial, monkeypatch):
    """From the folder that people stand in."""
    monkeypatch.chdir(trial.root / "tracks")

    assert find_trial(trial.root.__class__("000000.parquet")).resolve() == trial.root.resolve()


def test_a_path_outside_every_trial_is_an_error(tmp_path):
    """It says where it looked."""
    with pytest.raises(InputError, match="not in a trial"):
        find_trial(tmp_path)
