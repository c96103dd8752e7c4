"""What features of speeds gain: nothing where nothing is missing, most of what is in any form."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from zfcal.diagnose.features.naming import best_by_name, tell
from zfcal.diagnose.features.paces import Paces, pace_gains
from zfcal.diagnose.features.swum import swum_of
from zfcal.diagnose.screening import Screen
from zfcal.model.effects import all_effects, find_effect
from zfcal.model.features import AWAY_M
from zfcal.model.kernels.state import HX, HY, SPEED, ZONE, X, Y
from zfcal.model.paces import Spread

ALL = tuple(all_effects())


@pytest.fixture(scope="module")
def nothing(base):
    """Return fits to ten minutes of fish that do as the base model does."""
    scene, fitted = base
    return Paces(screen=Screen(scene=scene, fitted=fitted))


@pytest.fixture(scope="module")
def changed(nothing):
    """Return what makes fits to the same fish with other speeds; all else stays as it was."""

    def make(factor):
        scene = nothing.scene
        moves = dataclasses.replace(scene.moves, speed_m_s=scene.moves.speed_m_s * factor)
        other = dataclasses.replace(scene, moves=moves)
        return Paces(screen=Screen(scene=other, fitted=nothing.screen.fitted))

    return make


def test_nothing_is_gained_where_nothing_is_missing(nothing):
    """No name is told; all names that act on speeds in company are asked."""
    found = pace_gains(nothing, ALL)
    assert tell(found) is None
    assert {each.name for each in found} == {each.name for each in ALL if each.paces}
    assert -15 < best_by_name(found)[0].nats < 5
    for one, other in zip(found, pace_gains(nothing, ALL, n_workers=3), strict=True):
        assert (one.key, one.n_strengths) == (other.key, other.n_strengths)
        np.testing.assert_array_equal(one.log_p, other.log_p)


def test_scores_are_standard_normal_in_each_field(nothing):
    """Their mean is zero in each field and for each fish, their variance one."""
    assert nothing.scores.std() == pytest.approx(1.0)
    for group in (nothing.screen.fields[nothing.rows], nothing.turns.track):
        sums = np.bincount(group, nothing.scores)
        assert np.abs(sums).max() < 1e-6
    assert np.abs(np.quantile(nothing.scores, [0.16, 0.5, 0.84]) - [-1, 0, 1]).max() < 0.1


def by_last_turn(paces):
    """Slower by a tenth after wide turns."""
    return np.where(paces.swum.last_turn_rad > 0.8, 0.85, 1.0)


def by_the_nearest(paces):
    """Faster after a fast nearest one."""
    swum = paces.swum
    nearest = np.take_along_axis(swum.others, swum.distance_m.argmin(axis=1)[:, None], 1)[:, 0]
    return np.exp(0.08 * nearest)


def by_company(paces):
    """Faster with two others within 9 cm."""
    return np.where((paces.swum.distance_m < 0.09).sum(axis=1) >= 2, 1.25, 1.0)


def test_the_turn_of_a_step_is_that_from_the_heading_before_to_its_own(nothing):
    """Of the last turn one step later, where the fish moved on."""
    turns, states = nothing.turns, nothing.scene.states
    before, after = (states[turns.at + k, :, turns.who][:, [HX, HY]] for k in (0, 1))
    cosine = np.clip((before * after).sum(axis=1), -1, 1)
    np.testing.assert_allclose(np.cos(nothing.swum.turn_rad), cosine, atol=1e-9)
    assert np.abs(nothing.swum.turn_rad - nothing.swum.last_turn_rad).max() > 1


def test_fish_that_are_slow_in_turns_are_no_crowd_given_the_turn(nothing, changed):
    """They turn where others are. Fish that are slow near others are a crowd given the turn too."""
    times, coupling = np.ones(len(nothing.scene.moves)), find_effect("speed-turn-coupling")
    near = np.where(nothing.swum.ahead_m < 0.1, 0.8, 1.0)
    for factor, is_gone in ((1 - 0.8 * nothing.swum.turn_rad / np.pi, True), (near, False)):
        times[nothing.rows] = factor
        fits = changed(times)
        given = dataclasses.replace(fits, given=(coupling,))
        alone, left = (
            best_by_name(pace_gains(each, [find_effect("crowding")]))[0].nats
            for each in (fits, given)
        )
        assert alone > 10
        assert (left < 0.2 * alone) is is_gone


def test_a_second_neighbour_may_count_for_all_others(nothing, changed):
    """Fish that are slower in company of more than one: yet another changes nothing."""
    near = nothing.swum.here * np.exp(-0.5 * (nothing.swum.distance_m / 0.1) ** 2)
    times = np.ones(len(nothing.scene.moves))
    times[nothing.rows] = np.where(near.sum(axis=1) > 1.5, 0.85, 1.0)
    found = pace_gains(changed(times), [find_effect("crowding")])
    nats = {each.label: each.nats for each in found}
    assert nats["company, few or many"] > 1.3 * nats["number"] > 10
    assert nats["company, few or many"] > 1.3 * nats["the nearest"]


def late(paces):
    """Slower for the last third of the recording."""
    return np.where(paces.swum.time > 0.65, 0.85, 1.0)


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("speed-turn-coupling", by_last_turn),
        ("speed-matching", by_the_nearest),
        ("crowding", by_company),
        ("fatigue", late),
    ],
)
def test_a_form_that_nobody_knows_is_told(nothing, changed, name, factor):
    """Speeds are multiplied by something known before the step: its name leads."""
    times = np.ones(len(nothing.scene.moves))
    times[nothing.rows] = factor(nothing)
    told = tell(pace_gains(changed(times), ALL))
    assert told.gain.name == name
    assert told.ties == ()
    assert told.gain.nats > 15


def scores_by_last(nothing, rule):
    """Return fits to speeds that are the same ones, put in another order by a rule."""
    scene = nothing.scene
    moves, states = scene.moves, scene.states.copy()
    speed, rng = moves.speed_m_s.copy(), np.random.default_rng(3)
    for track in np.unique(moves.track):
        mine = np.flatnonzero(moves.track == track)
        speed[mine] = rule(speed[mine], rng)
        states[moves.at[mine] + 1, SPEED, moves.who[mine]] = speed[mine]
    other = dataclasses.replace(
        scene, states=states, moves=dataclasses.replace(moves, speed_m_s=speed)
    )
    return Paces(screen=Screen(scene=other, fitted=nothing.screen.fitted))


def rhythm(speed, _rng):
    """Fast, slow, slow: each third step is faster by a third."""
    return speed * np.where(np.arange(len(speed)) % 3 == 0, 1.3, 0.95)


def test_bursts_are_told_by_the_own_last_speeds(nothing):
    """Whether a speed is kept for a step or swings."""
    told = tell(pace_gains(scores_by_last(nothing, rhythm), ALL))
    assert (told.gain.name, told.gain.label) == ("burst-and-coast", "by the last three speeds")
    assert told.gain.nats > 15


def gliding(speed, rng):
    """One step in eight keeps 0.7 of the last speed."""
    made = speed.copy()
    for k in range(1, len(made)):
        if rng.uniform() < 0.12:
            made[k] = 0.7 * made[k - 1] + rng.normal(0, 0.004)
    return np.maximum(made, 0.012)


def kicking(speed, rng):
    """Two slow steps are followed by a kick, now and then."""
    made = speed.copy()
    slow = np.quantile(speed, 0.4)
    for k in range(2, len(made)):
        if max(made[k - 1], made[k - 2]) < slow and rng.uniform() < 0.25:
            made[k] = np.quantile(speed, 0.9)
    return made


@pytest.mark.parametrize(
    ("rule", "label"),
    [
        (gliding, "a share of the last speed"),
        (kicking, "slow and fast ones, by the last two"),
    ],
)
def test_speeds_of_a_few_steps_are_told(nothing, rule, label):
    """The mean hardly changes; how speeds are spread does, and it is there all the time."""
    paces = scores_by_last(nothing, rule)
    told = tell(pace_gains(paces, ALL))
    assert (told.gain.name, told.gain.label) == ("burst-and-coast", label)
    assert told.gain.nats > 15
    course = paces.course(told.gain)
    assert course.in_all_minutes
    assert course.in_all_phases


def the_feature(name, label):
    """Return a feature of speeds by its label."""
    return next(each for each in find_effect(name).paces if each.label == label)


def spending(speed, _rng):
    """Slower, the faster it was in the mean of the last 18 steps (3.6 s)."""
    made = speed.copy()
    for k in range(18, len(made)):
        made[k] = speed[k] * np.exp(-1.5 * (made[k - 18 : k].mean() / speed.mean() - 1))
    return made


def test_a_budget_of_some_seconds_is_told_by_longer_means(nothing):
    """That over two seconds sees a part of it."""
    paces = scores_by_last(nothing, spending)
    short, long = (
        paces.gain("burst-and-coast", the_feature("burst-and-coast", f"by the {label}")).nats
        for label in ("mean over two seconds", "means over two and four seconds")
    )
    assert long > short + 10 > 10


def test_longer_means_are_of_the_scores_of_so_many_steps(nothing):
    """Ten steps at 5 Hz are two seconds, 20 are four; the last one is among them."""
    swum, turns = nothing.swum, nothing.turns
    assert nothing.scene.dt_s == pytest.approx(0.2)
    mine = np.flatnonzero(turns.track == turns.track[0])
    # The first of its moves before which 20 others have no gap.
    k = np.flatnonzero(turns.at[mine[20:]] - turns.at[mine[:-20]] == 20)[0] + 20
    for n, mean in ((10, swum.lately), (20, swum.longer)):
        by_hand = swum.last[mine[k - n + 1 : k + 1]].mean()
        assert mean[mine[k]] == pytest.approx(by_hand, abs=1e-12)


def test_turns_that_are_not_known_are_no_straight_runs(nothing):
    """After a gap there are three steps without a run; they have no weight."""
    scene, turns = nothing.scene, nothing.turns
    states = scene.states.copy()
    gap = 400
    states[gap, ZONE] = 0
    swum = swum_of(dataclasses.replace(scene, states=states), turns, nothing.scores)
    after = (turns.at > gap) & (turns.at <= gap + 3)
    assert after.sum() > 5
    assert np.isnan(swum.bent_rad[after]).all()
    later = turns.at > gap + 3
    np.testing.assert_array_equal(swum.bent_rad[later], nothing.swum.bent_rad[later])
    weights = the_feature("speed-turn-coupling", "slow and fast ones, by the last three turns")
    assert not weights.weights(swum)[after].any()
    widest = np.max([swum.last_turn_rad[later], swum.bent_rad[later]], axis=0)
    np.testing.assert_allclose(widest, swum.bent_rad[later])


def test_bursts_after_straight_runs_are_told_by_the_last_three_turns(nothing, changed):
    """Slow and middling speeds stay in their proportions."""
    moves, rng = nothing.scene.moves, np.random.default_rng(5)
    times = np.ones(len(moves.at))
    straight = nothing.swum.bent_rad < 0.35
    assert 0.02 < straight.mean() < 0.7
    times[nothing.rows] = np.where(straight & (rng.uniform(size=len(straight)) < 0.12), 2.0, 1.0)
    told = tell(pace_gains(changed(times), ALL))
    assert told.gain.name == "speed-turn-coupling"
    assert told.gain.label == "slow and fast ones, by the last three turns"


def test_who_is_ahead_is_before_the_fish(nothing):
    """Within 60 degrees of its heading, whoever else is near."""
    swum, turns, states = nothing.swum, nothing.turns, nothing.scene.states
    rows = np.flatnonzero(swum.here.all(axis=1))[::50]
    assert len(rows) > 100
    for row in rows:
        at, who = turns.at[row], turns.who[row]
        others = [j for j in range(states.shape[2]) if j != who]
        way = states[at][[X, Y]][:, others] - states[at][[X, Y], who][:, None]
        cosine = states[at, HX, who] * way[0] + states[at, HY, who] * way[1]
        np.testing.assert_array_equal(swum.ahead[row], cosine > 0.5 * np.hypot(*way))
        ahead = swum.distance_m[row][swum.ahead[row]]
        assert swum.ahead_m[row] == ahead.min(initial=AWAY_M)


@pytest.mark.parametrize(
    "label", ["of who is ahead, over two seconds", "the speed of who is ahead"]
)
def test_who_is_ahead_is_matched_by_some(nothing, changed, label):
    """In mean speed, or in steps that have its speed; others behind do not count."""
    swum, moves, rng = nothing.swum, nothing.scene.moves, np.random.default_rng(6)
    first = np.where(swum.ahead, swum.distance_m, np.inf).argmin(axis=1)
    rows = np.arange(len(first))
    is_near = swum.ahead_m < 0.2
    times = np.ones(len(moves.at))
    if "over" in label:
        times[nothing.rows] = np.exp(0.4 * is_near * swum.others_lately[rows, first])
    else:
        own = np.nan_to_num(swum.others_m_s[rows, first], nan=0.0)
        asked = is_near & (own > 0) & (rng.uniform(size=len(own)) < 0.2)
        speed = moves.speed_m_s[nothing.rows]
        times[nothing.rows] = np.where(asked, own / speed, 1.0)
    feature = the_feature("speed-matching", label)
    assert changed(np.ones(len(times))).gain("speed-matching", feature).nats < 5
    assert changed(times).gain("speed-matching", feature).nats > 10


def test_speeds_that_change_slowly_are_not_copied(nothing):
    """They are as near to the speed of a second ago."""

    def drifts(speed, _rng):
        return speed * np.exp(0.5 * np.sin(np.arange(len(speed)) / 60))

    gains = pace_gains(scores_by_last(nothing, drifts), [find_effect("burst-and-coast")])
    nats = {gain.label: gain.log_p.sum() for gain in gains}
    assert nats["a share of the last speed"] < 0.2 * nats["by the last three speeds"]


def test_speeds_that_are_spread_more_at_times_are_no_bursts(nothing):
    """The spread of each fish drifts, its median does not: no speed answers to the last one."""

    def varies(speed, rng):
        drift = np.exp(lfilter([0.038], [1, -0.992], rng.normal(size=len(speed))))
        return np.maximum(np.exp(np.log(0.07) + 0.4 * drift * rng.normal(size=len(speed))), 0.012)

    paces = scores_by_last(nothing, varies)
    assert tell(pace_gains(paces, ALL)) is None
    bursts = find_effect("burst-and-coast")
    bare = [
        paces.gain("burst-and-coast", dataclasses.replace(each, ago=None)).nats
        for each in bursts.paces
        if isinstance(each, Spread)
    ]
    assert max(bare) > 15


@pytest.mark.slow
def test_independent_speeds_of_short_tracks_do_not_swing(nothing):
    """The mean over two seconds is asked of tracks that are a hundred times as long."""
    scene = nothing.scene
    first = scene.moves.at // 150
    pieces = (scene.tracks * 1000 + (np.arange(len(scene.k)) // 150)[:, None]).astype(np.int32)
    speed = np.random.default_rng(8).permutation(scene.moves.speed_m_s)
    states = scene.states.copy()
    states[scene.moves.at + 1, SPEED, scene.moves.who] = speed
    moves = dataclasses.replace(
        scene.moves, track=(scene.moves.track * 1000 + first).astype(np.int32), speed_m_s=speed
    )
    # Two seconds are thirty steps of a fifteenth of a second.
    other = dataclasses.replace(scene, moves=moves, tracks=pieces, states=states, dt_s=1 / 15)
    paces = Paces(screen=Screen(scene=other, fitted=nothing.screen.fitted))
    assert paces.has_law
    assert tell(pace_gains(paces, ALL)) is None


def test_a_few_slow_steps_among_others_are_crowding(nothing, changed):
    """One in ten of those with two others near is slow."""
    times = np.ones(len(nothing.scene.moves))
    near = (nothing.swum.distance_m < 0.1).sum(axis=1) >= 2
    chosen = near & (np.random.default_rng(5).uniform(size=len(near)) < 0.2)
    times[nothing.rows] = np.where(chosen, 0.3, 1.0)
    told = tell(pace_gains(changed(times), ALL))
    assert told.gain.name == "crowding"
    assert told.gain.label.startswith("slow and fast ones")


@pytest.mark.slow
def test_what_one_room_does_to_speeds_is_no_effect(nothing, changed):
    """A lamp over one room makes fish fast there: fields have means of their own."""
    scene = nothing.scene
    xy = scene.states[scene.moves.at, :2, scene.moves.who]
    for times in (1.2, 1.8):
        lit = changed(np.where(xy[:, 0] > xy[:, 1], times, 1.0))
        assert tell(pace_gains(lit, ALL)) is None


def test_nor_what_one_fish_does_all_the_time(nothing, changed):
    """Some fish are faster than others: each has a mean of its own."""
    track = nothing.scene.moves.track
    own = np.linspace(0.6, 1.6, len(np.unique(track)))
    times = own[np.unique(track, return_inverse=True)[1]]
    assert tell(pace_gains(changed(times), ALL)) is None


@pytest.mark.slow
def test_tracks_in_pieces_have_means_of_their_own(nothing):
    """More than a dozen of them, of individuals that differ."""
    scene = nothing.scene
    track = scene.moves.track * 10 + (4 * scene.moves.at // len(scene.k)).astype(np.int32)
    pieces = scene.tracks * 10 + (4 * np.arange(len(scene.k)) // len(scene.k))[:, None]
    times = np.linspace(0.8, 1.2, 5)[np.unique(scene.moves.track, return_inverse=True)[1]]
    moves = dataclasses.replace(scene.moves, track=track, speed_m_s=scene.moves.speed_m_s * times)
    other = dataclasses.replace(scene, moves=moves, tracks=pieces.astype(np.int32))
    paces = Paces(screen=Screen(scene=other, fitted=nothing.screen.fitted))
    assert len(np.unique(paces.turns.track)) == 20
    assert tell(pace_gains(paces, ALL)) is None


def test_short_tracks_are_not_asked(nothing):
    """Of 40 moves nobody can say that they swing beside their own mean."""
    scene = nothing.scene
    moves = dataclasses.replace(
        scene.moves, track=scene.moves.track * 1000 + (scene.moves.at // 40).astype(np.int32)
    )
    other = dataclasses.replace(scene, moves=moves)
    assert pace_gains(Paces(screen=Screen(scene=other, fitted=nothing.screen.fitted)), ALL) == []


def test_speeds_that_are_all_but_one_have_no_law(nothing):
    """Of nine in ten moves at one speed, rounding aside, the others say nothing by their ranks."""
    scene, rng = nothing.scene, np.random.default_rng(2)
    even = 0.07 + rng.normal(0, 1e-7, len(scene.moves))
    speed = np.where(rng.random(len(even)) < 0.1, scene.moves.speed_m_s, even)
    other = dataclasses.replace(scene, moves=dataclasses.replace(scene.moves, speed_m_s=speed))
    paces = Paces(screen=Screen(scene=other, fitted=nothing.screen.fitted))
    assert not paces.has_law
    assert pace_gains(paces, ALL) == []


def test_one_fish_has_nobody_to_match(screen):
    """Features of others have no strength then."""
    paces = Paces(screen=screen(5, n_fish=1), beside=(find_effect("speed-matching"),))
    assert {each.name for each in pace_gains(paces, ALL)} <= {
        "burst-and-coast", "fatigue", "speed-turn-coupling",
    }  # fmt: skip


@pytest.mark.slow
def test_beside_an_effect_its_own_features_gain_nothing(nothing, changed):
    """What another name gains by them is gone as well."""
    times = np.ones(len(nothing.scene.moves))
    times[nothing.rows] = by_last_turn(nothing)
    there = changed(times).and_beside(find_effect("speed-turn-coupling"))
    assert tell(pace_gains(there, ALL)) is None


def test_what_is_there_at_first_alone_is_told_by_the_time(nothing, changed):
    """Two minutes of ten: that it goes is what a feature by the time says."""
    times = np.ones(len(nothing.scene.moves))
    times[nothing.rows] = by_the_nearest(nothing) ** 4
    first = np.where(nothing.scene.time_s(nothing.scene.moves) < 120, times, 1.0)
    paces = changed(first)
    told = tell(pace_gains(paces, ALL))
    assert (told.gain.name, told.gain.label) == ("speed-matching", "of all near, by the time")
    assert paces.course(told.gain).in_all_minutes


@pytest.mark.slow
def test_what_comes_and_goes_is_not_there_in_all_minutes(nothing, changed):
    """Two of ten minutes have it, far apart: gains are told, and differ between minutes."""
    times = np.ones(len(nothing.scene.moves))
    times[nothing.rows] = by_the_nearest(nothing) ** 2
    always = changed(times)
    seldom = np.where(nothing.scene.time_s(nothing.scene.moves) % 300 < 60, times**2, 1.0)
    sometimes = changed(seldom)
    for paces, steady in ((always, True), (sometimes, False)):
        told = tell(pace_gains(paces, ALL))
        assert told.gain.name == "speed-matching"
        course = paces.course(told.gain)
        assert abs(course.apart.sum()) < 0.01 * np.abs(course.apart).sum()
        assert course.in_all_minutes is steady


def test_who_is_known_for_a_short_time_has_no_past(nothing):
    """In the first steps of a track there is no last speed, and none two or three steps ago."""
    swum, turns = nothing.swum, nothing.turns
    first = turns.at == 0
    assert (swum.last[first] == 0).all()
    for ago, values in enumerate((swum.last, swum.before_last, swum.third), start=1):
        assert (values[turns.at < ago] == 0).all()
        assert (values[turns.at > 50] != 0).mean() > 0.7
