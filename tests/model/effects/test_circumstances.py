"""Features under circumstances: each weight for each of them, and all of them alike among these."""

import dataclasses

import numpy as np
import pytest

from zfcal.model.effects.circumstances import (
    CIRCUMSTANCES,
    OF_EACH,
    PACED,
    by_circumstances,
    each_fish,
    each_under,
    paces_by,
)
from zfcal.model.features import Component, Leaving, Tilt, Turned
from zfcal.model.paces import Pace, Swum


def toward_all(seen):
    """Return a weight for each other one, and twice that."""
    return np.stack([seen.attention, 2 * seen.attention], axis=-1)


def ahead(seen):
    """Return the own heading, and its opposite, shape (step, 2, 2)."""
    return np.stack([seen.own_heading, -seen.own_heading], axis=1)


DRAWN = Component(label="drawn", toward="bearing", weights=toward_all)
LEANING = Tilt(label="leaning", vectors=ahead)
TURNED = Turned(label="turned", by=lambda seen: seen.last_turn_rad, neighbours=False)
LEAVING = Leaving(label="leaving", weights=lambda seen: seen.left_s[:, None])


@pytest.mark.parametrize("name", CIRCUMSTANCES)
def test_circumstances_of_steps_add_up_to_one(seen, name):
    """None is negative: what is everywhere alike is one of the cases."""
    found = CIRCUMSTANCES[name](seen)
    assert (found >= 0).all()
    np.testing.assert_allclose(found.sum(axis=-1), 1.0)
    assert found.shape[0] == len(seen.zone)


@pytest.mark.parametrize("name", OF_EACH)
def test_circumstances_of_others_add_up_to_one(seen, name):
    """Each other one has its own."""
    found = OF_EACH[name](seen)
    np.testing.assert_allclose(found.sum(axis=-1), 1.0)
    assert found.shape[:2] == seen.distance_m.shape


def test_weights_are_those_of_the_feature_times_circumstances(seen):
    """Two weights in three zones are six, the zone of a step alone being more than nothing."""
    made = {each.label: each for each in by_circumstances(DRAWN).features}
    found = made["drawn, by the zone"].weights(seen)
    assert found.shape == (*seen.attention.shape, 6)
    own = found.reshape(*seen.attention.shape, 2, 3)
    np.testing.assert_allclose(own.sum(axis=-1), toward_all(seen))
    for step, zone in enumerate(seen.zone):
        others = np.delete(own[step], zone - 1, axis=-1)
        assert not others.any()


def test_others_have_circumstances_of_their_own(seen):
    """The nearer one counts by another strength than the farther one."""
    made = {each.label: each for each in by_circumstances(DRAWN, of_each=True).features}
    near = dataclasses.replace(seen, distance_m=np.tile([0.03, 0.1, 0.25], (len(seen.zone), 1)))
    found = made["drawn, by distance"].weights(near).reshape(*seen.attention.shape, 2, 3)
    for other in range(3):
        np.testing.assert_allclose(found[:, other, :, other], toward_all(seen)[:, other])
        assert not np.delete(found[:, other], other, axis=-1).any()
    assert not any("distance" in each.label for each in by_circumstances(DRAWN).features)


def test_tilts_turns_and_leaving_have_them_too(seen):
    """The sums over circumstances are the feature's own weights."""
    for core, of, shape in (
        (LEANING, lambda each: each.vectors, (2, -1, 2)),
        (TURNED, lambda each: each.by, (1, -1)),
        (LEAVING, lambda each: each.weights, (1, -1)),
    ):
        for each in by_circumstances(core).features:
            found = of(each)(seen)
            whole = found.reshape(len(seen.zone), *shape).sum(axis=2)
            own = of(core)(seen)
            np.testing.assert_allclose(whole, own.reshape(whole.shape))


def test_what_a_late_response_takes_the_place_of_goes_by_them_as_well(seen):
    """Else others would be heeded twice in some zones."""
    core = dataclasses.replace(DRAWN, instead=toward_all)
    for each in by_circumstances(core).features:
        np.testing.assert_array_equal(each.instead(seen), each.weights(seen))


def test_what_has_to_be_gained_more_than_is_part_of_the_feature(seen):
    """Its weights are the last ones, and the same."""
    alone = dataclasses.replace(
        DRAWN, label="all", weights=lambda seen: seen.attention[..., None] ** 0
    )
    for each in by_circumstances(DRAWN, alone=each_under(alone)).features:
        whole, over = each.weights(seen), each.over.weights(seen)
        np.testing.assert_array_equal(whole[..., -over.shape[-1] :], over)
        assert whole.shape[-1] == 3 * over.shape[-1]


def test_what_has_to_be_gained_more_than_is_one_for_all_that_share_it(seen):
    """So it is fitted once; and what steps have about them is worked out once."""
    alone = each_under(dataclasses.replace(DRAWN, label="all"))
    one, other = (
        by_circumstances(dataclasses.replace(DRAWN, label=label), alone=alone).features
        for label in ("near", "far")
    )
    assert [each.over for each in one] == [each.over for each in other]
    asked = []

    def once(what):
        asked.append(what)
        return what.time

    assert seen.once(once) is seen.once(once)
    assert asked == [seen]
    assert dataclasses.replace(seen, time=1 - seen.time).once(once)[0] == 1 - seen.time[0]


def test_names_that_are_left_out_and_names_that_are_asked_for():
    """Of what a feature goes by itself there is nothing to ask."""
    labels = {each.label for each in by_circumstances(TURNED, without=("the last turn",)).features}
    assert labels == {f"turned, by {name}" for name in CIRCUMSTANCES if name != "the last turn"}
    few = by_circumstances(TURNED, among=("who", "the time"))
    assert [each.label for each in few.features] == ["turned, by who", "turned, by the time"]
    assert few.n_tried == 2


def test_a_feature_under_circumstances_is_no_curve():
    """Its weights go by more than one number."""
    assert all(each.along is None for each in by_circumstances(DRAWN).features)


def swum(n=5, others=2):
    """Return what there was before some steps, at random."""
    rng = np.random.default_rng(1)
    values = {
        field.name: rng.normal(size=(n, others) if field.name in {"others", "distance_m"} else n)
        for field in dataclasses.fields(Swum)
    }
    values["track"] = np.arange(n, dtype=np.int32) % 3
    values["time"] = np.linspace(0, 1, n)
    values["here"] = np.ones((n, others), dtype=bool)
    return Swum(**values)


@pytest.mark.parametrize("name", PACED)
def test_speeds_have_circumstances_too(name):
    """The sum over them is the feature itself."""
    core = Pace(label="by the last speed", weights=lambda each: each.last[:, None])
    (made,) = paces_by(core, name)
    before = swum()
    np.testing.assert_allclose(made.weights(before).sum(axis=1), before.last)
    assert made.label == f"by the last speed, by {name}"


def test_each_fish_is_one_of_them(seen):
    """Three tracks, and nobody in the rest."""
    found = each_fish(seen)
    assert found.shape == (len(seen.track), 3)
    np.testing.assert_array_equal(found.argmax(axis=1) == found[0].argmax(), seen.track == 0)
