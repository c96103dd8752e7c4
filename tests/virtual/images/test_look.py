"""What can be said about drawn images, and what is refused."""

import dataclasses

import pytest

from zfcal.errors import InputError
from zfcal.virtual.images.look import CLEAN, HARD, PRESETS, USUAL, Look, look_of


def test_three_presets_from_easy_to_hard():
    """Noise grows, contrast falls; the clean one is lossless."""
    assert list(PRESETS) == [CLEAN, USUAL, HARD]
    clean, usual, hard = PRESETS.values()
    assert clean.noise_grey < usual.noise_grey < hard.noise_grey
    assert clean.jpeg_quality is None
    assert usual.jpeg_quality > hard.jpeg_quality
    contrast = [look.floor_grey - look.fish_grey for look in PRESETS.values()]
    assert contrast[0] >= contrast[1] > contrast[2]


def test_values_of_a_preset_can_be_changed():
    """The others stay."""
    changed = look_of(HARD, {"noise_grey": 1.0})
    assert changed.noise_grey == 1.0
    assert dataclasses.replace(changed, noise_grey=PRESETS[HARD].noise_grey) == PRESETS[HARD]


def test_every_value_is_described():
    """With its name in the documentation of the class."""
    for field in dataclasses.fields(Look):
        assert field.name in (Look.__doc__ or "")


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"noise_grey": -1.0}, "noise_grey must be from 0 to 255, got -1.0"),
        ({"floor_grey": 300.0}, "floor_grey must be from 0 to 255"),
        ({"shadow_opacity": 1.5}, "shadow_opacity must be from 0 to 1,"),
        ({"fish_length_m": float("nan")}, "fish_length_m must be a number, got nan"),
        ({"fish_length_m": 0.0}, "must be positive"),
        ({"jpeg_quality": 0}, "jpeg_quality must be 1 to 100"),
        ({"led_colour_bgr": (0.0, 2.0, 0.0)}, "led_colour_bgr must be from 0 to 1"),
        ({"fish_lenght_m": 0.03}, "no 'fish_lenght_m'"),
    ],
)
def test_wrong_values_are_named(changes, says):
    """With what is allowed."""
    with pytest.raises(InputError, match=says):
        look_of(USUAL, changes)


def test_an_unknown_preset_is_named():
    """With those that there are."""
    with pytest.raises(InputError, match="No preset 'ugly'") as error:
        look_of("ugly")
    assert "clean, usual, hard" in error.value.hint


def test_the_documentation_states_every_value(repository):
    """Of each preset, as it is."""

    def shown(value):
        if value is None:
            return "none (PNG)"
        return ", ".join(f"{x:g}" for x in (value if isinstance(value, tuple) else (value,)))

    text = (repository / "docs" / "video.md").read_text("utf-8")
    for field in dataclasses.fields(Look):
        values = " | ".join(shown(getattr(look, field.name)) for look in PRESETS.values())
        assert f"| `{field.name}` | {values} |" in text
