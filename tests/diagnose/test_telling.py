"""Findings in plain words."""

import pytest

from zfcal.diagnose.telling import says
from zfcal.model.effects import all_effects


def test_a_sentence_with_size_and_interval(candidate):
    """What fish do, how strongly, and what the number is."""
    text = says(candidate("alignment"), {"weight": 12.345}, {"weight": (9.87, 14.321)})
    assert text.startswith("Fish turn toward the direction in which their neighbours swim. ")
    assert "Fitted weight: 12.3 (95 % interval 9.87 to 14.3)." in text
    assert text.endswith("per steradian of solid angle.")


def test_a_negative_strength_has_the_opposite_sentence(candidate):
    """A fish that has just been fast slows down."""
    own = candidate("burst-and-coast")
    assert says(own, {"exponent": 0.4}, {}).startswith(own.effect.says)
    assert says(own, {"exponent": -0.4}, {}).startswith(own.effect.opposite)
    assert "Fitted exponent: -0.4." in says(own, {"exponent": -0.4}, {})


def test_without_an_interval_none_is_told(candidate):
    """The value stands alone."""
    text = says(candidate("reaction-delay"), {"share": 0.6, "delay_s": 0.4}, {})
    assert "interval" not in text
    assert "Fitted share: 0.6." in text


def test_a_curve_is_told_knot_by_knot(candidate):
    """With what it goes by; the sentence is that of the side on which it is strongest."""
    bent = {"by": 4.0, "knot_1": 0.03, "knot_2": 0.1, "knot_3": 0.25}
    own = candidate("turning-bias", **bent)
    values = own.values(-0.1) | {"more_1": 1.1, "more_3": -0.4}
    text = says(own, values, {"strength": (-0.2, 0.0)})
    assert text.startswith(own.effect.says)
    assert (
        "Fitted strength by distance to the nearest: 1 at 0.03 m, -0.1 at 0.1 m, -0.5 at 0.25 m."
        in text
    )
    assert "4 at 0.03 m" in says(own, values | {"more_1": 9.0}, {})
    assert says(own, values | {"more_1": 0.2}, {}).startswith(own.effect.opposite)


def test_an_interval_of_a_shape_is_not_that_of_the_strength(candidate):
    """Only the strength is told."""
    text = says(candidate("alignment"), {"weight": 5.0, "kappa": 3.0}, {"kappa": (1.0, 5.0)})
    assert "interval" not in text


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("turning-memory", {"strength": 4.0}),
        ("turning-memory", {"strength": -3.99}),
        ("alignment", {"weight": 50.0}),
    ],
)
def test_a_strength_at_the_end_of_its_range_is_told(candidate, name, values):
    """The fit went as far as it may: the number is a bound and no estimate."""
    assert "the end of its range" in says(candidate(name), values, {})


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("turning-memory", {"strength": 3.9}),
        ("turning-memory", {"strength": 0.0}),
        ("alignment", {"weight": 0.0}),
        ("reaction-delay", {"share": 1.0, "delay_s": 0.4}),
    ],
)
def test_an_end_that_nature_sets_is_none(candidate, name, values):
    """All attention is all there is, and nothing is nothing."""
    assert "range" not in says(candidate(name), values, {}).split("Fitted")[1]


@pytest.mark.parametrize("effect", all_effects(), ids=lambda effect: effect.name)
def test_every_effect_can_be_told(candidate, effect):
    """One sentence at least for either sign that it can have, and the sentences differ."""
    own = candidate(effect.name)
    positive = says(own, {effect.strength: 0.5}, {})
    assert positive.startswith(effect.says)
    assert effect.says.endswith(".")
    if own.signed:
        assert says(own, {effect.strength: -0.5}, {}).split("Fitted")[0].strip() == effect.opposite
        assert effect.opposite != effect.says
