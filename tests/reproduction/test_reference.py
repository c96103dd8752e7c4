"""Published scores as files."""

import math

import pytest

from zfcal.errors import InputError
from zfcal.reproduction.reference import read_reference

OWN = """
schema = "zfcal.reference/1"
source = "our rig, 2025"
n_trials = 8
intervals = [{ end_s = 120, D = 0.7 }]

[[contrasts]]
name = "distances"
feature = "D"
from_s = 120
to_s = 240
value = 0.75
sd = 0.04
"""


@pytest.fixture
def write(tmp_path):
    """Return what writes a reference file."""

    def made(text):
        path = tmp_path / "reference.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return made


def test_the_published_scores_ship_with_zfcal():
    """S of ten trials at 180 s and 300 s, and the plateau from 360 s on."""
    shipped = read_reference()
    assert shipped.n_trials == 10
    assert shipped.scoring == "paper"
    values = [(each.from_s, each.to_s, each.value) for each in shipped.contrasts]
    assert values == [(180, 180, 0.610), (300, 300, 0.827), (360, math.inf, 0.850)]
    assert all(math.isnan(each.sd) for each in shipped.contrasts)


@pytest.mark.parametrize(("end_s", "value"), [(180, 0.61), (300, 0.827), (360, 0.85), (1800, 0.85)])
def test_what_was_published_of_a_window(end_s, value):
    """A contrast to the end of the trial is the value of all its windows."""
    assert read_reference().published("S", end_s) == value


@pytest.mark.parametrize(("feature", "end_s"), [("S", 120), ("S", 240), ("D", 300)])
def test_what_was_not_published_is_not_known(feature, end_s):
    """NaN, and never zero."""
    assert math.isnan(read_reference().published(feature, end_s))


def test_ones_own_reference(write):
    """Margin and scoring have defaults."""
    own = read_reference(write(OWN))
    assert (own.n_trials, own.margin, own.scoring) == (8, 0.05, "paper")
    assert own.contrasts[0].sd == 0.04
    assert own.published("D", 120) == 0.7
    assert own.published("D", 180) == 0.75


@pytest.mark.parametrize(("old", "new", "says"), [
    ("n_trials = 8", "n_trials = 0", "n_trials"),
    ("value = 0.75", "value = 1.5", "value"),
    ('feature = "D"', 'feature = "X"', "feature"),
    ("sd = 0.04", "sdd = 0.04", "sdd"),
    ("to_s = 240", "to_s = 60", "ends at 60 s, before it begins"),
])  # fmt: skip
def test_a_wrong_reference_is_refused_by_name(write, old, new, says):
    """What, where, expected and got."""
    with pytest.raises(InputError, match=says):
        read_reference(write(OWN.replace(old, new)))


def test_two_contrasts_of_one_name_are_refused(write):
    """Nobody could tell them apart."""
    twice = OWN + OWN[OWN.index("[[contrasts]]") :]
    with pytest.raises(InputError, match="two contrasts are called 'distances'"):
        read_reference(write(twice))


def test_a_file_that_is_no_toml_is_refused(write):
    """And is named: nothing can be compared without it, so it is no damage that is left out."""
    with pytest.raises(InputError, match=r"reference\.toml: is not valid TOML"):
        read_reference(write("source = "))
