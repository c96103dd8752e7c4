"""Efficient scores: standard normal without an effect, large with it, blind to the base."""

import dataclasses
import math

import numpy as np
import pytest

from zfcal.diagnose.candidates import askable, both_sides, candidate_of, candidates_of
from zfcal.diagnose.naming import refit
from zfcal.diagnose.scores import by_track, centred, excess_deviate, summed, tame
from zfcal.diagnose.screening import Screen, ask_all
from zfcal.model.effects import find_effect
from zfcal.model.extended import maximise, with_effect
from zfcal.model.kernels.state import X, Y


def family(screen, arena):
    """Return all candidates that a recording can be asked for."""
    return candidates_of(askable(screen.scene, screen.fitted.parameters)[0], arena)


def rests_on_few_steps(candidate):
    """Return whether a handful of steps decides: across a way out, or still after still.

    Of these the sum is not normal in minutes of a recording; replicates say how it scatters.
    """
    return candidate.name == "freezing" or candidate.shape.get("heading_share") == 0.0


@pytest.mark.slow
def test_scores_of_a_right_model_are_standard_normal(screen, tank):
    """All shapes of all effects that rest on many steps, in five recordings of five minutes.

    Of some 350 z about 150 are not alike: the mean has a standard error of 0.08 and the
    spread one of 0.06, so that a centre of 0.3 or a spread wrong by a quarter is noticed.
    """
    z = []
    for seed in range(5):
        own = screen(300 + seed, minutes=5.0)
        asked = [each for each in family(own, tank) if not rests_on_few_steps(each)]
        z += [score.z for score in ask_all(own, asked, 1)]
    assert abs(np.mean(z)) < 0.25
    assert 0.8 < np.std(z) < 1.2
    assert np.abs(z).max() < 4.5


EFFECTS = {
    "alignment": ({"weight": 8.0, "kappa": 10.0}, 1),
    "group-cohesion": ({"weight": 0.5}, 1),
    "turning-bias": ({"strength": -0.25}, -1),
    "turning-memory": ({"strength": 0.5}, 1),
    "wall-persistence": ({"strength": 0.3}, 1),
    "directional-drift": ({"strength": 0.2, "direction_rad": 0.0}, 1),
    "place-preference": ({"strength": -0.6, "x_m": 0.22, "y_m": 0.77}, -1),
    "collective-departure": ({"strength": 1.0}, 1),
    "speed-turn-coupling": ({"strength": 0.3}, 1),
    "rear-blind-zone": ({"ignored": 0.5}, 1),
    "interaction-range": ({"ignored": 0.6, "range_m": 0.12}, 1),
    "leader-following": ({"strength": -0.5}, -1),
    "reaction-delay": ({"share": 0.4, "delay_s": 0.4}, 1),
    "burst-and-coast": ({"exponent": 0.2}, 1),
    "speed-matching": ({"exponent": 0.25}, 1),
    "crowding": ({"per_neighbour": -0.12}, -1),
    "fatigue": ({"per_hour": 3.0}, 1),
    "freezing": ({"rate_per_s": 0.02, "duration_s": 2.0}, 1),
    "boldness": ({"spread": 0.5}, 1),
    "robot-avoidance": ({"strength": 0.7}, 1),
}


@pytest.mark.parametrize(("name", "values", "sign"), [(n, *e) for n, e in EFFECTS.items()])
def test_a_moderate_effect_is_found_with_its_sign(screen, tank, name, values, sign):
    """Its best shape lies beyond five standard errors.

    In ten minutes of five fish; in twenty where they must first leave a room, which they do now
    and then.
    """
    minutes = 20.0 if name == "collective-departure" else 10.0
    own = screen(17, {name: values}, minutes=minutes, n_robots=int(name == "robot-avoidance"))
    scores = ask_all(own, candidates_of((find_effect(name),), tank), 1)
    signed = scores[0].candidate.signed
    best = max(scores, key=lambda score: abs(score.z) if signed else score.z)
    assert sign * best.z > 5.0
    assert sign * best.strength > 0


@pytest.fixture(scope="module")
def base(screen):
    """Return a screen of ten minutes of the base model."""
    return screen(11)


def test_what_the_model_can_explain_is_projected_off(base):
    """The model's own scores, in any combination, leave nothing; twice is once."""
    own = np.zeros(len(base.scene.turns))
    rng = np.random.default_rng(1)
    for scores, turns in zip(base.fitted.scores, base.fitted.turns, strict=True):
        # The lapse stands last; at its bound it explains nothing.
        own[turns.rows] = scores[:, :-1] @ rng.normal(size=scores.shape[1] - 1)
    assert np.abs(base.project(own)).max() < 1e-8 * np.abs(own).max()

    other = rng.normal(size=own.size)
    once = base.project(other)
    assert base.project(once) == pytest.approx(once, abs=1e-10)
    for scores, turns in zip(base.fitted.scores, base.fitted.turns, strict=True):
        sizes = np.linalg.norm(scores, axis=0) * np.linalg.norm(once)
        assert np.abs(once[turns.rows] @ scores[:, :-1]).max() < 1e-8 * sizes.max()


def test_an_effect_in_the_model_is_silent(screen, tank, candidate):
    """Asked for in the model that made the recording, it has nothing left to say."""
    own = screen(17, {"turning-bias": {"strength": -0.25}})
    model = with_effect(own.fitted.parameters, "turning-bias", {"strength": -0.1})
    fitted = maximise(own.scene, model, free=(("turning-bias", "strength"),))
    left = Screen(scene=own.scene, fitted=fitted).ask(candidate("turning-bias"))
    assert abs(left.z) < 0.5


def test_components_are_asked_for_where_a_whole_turn_would_draw_them(base, candidate):
    """The score of a component is what the model with it gains, in a model that turns all ways."""
    given = {"strength": 4.0, "direction_rad": 1.0, "turning": 2.0}
    model = with_effect(base.fitted.parameters, "directional-drift", given)
    fitted = maximise(base.scene, model, start=base.fitted.x, rounds=0)
    asked = candidate("alignment", kappa=20.0)
    added = with_effect(fitted.parameters, "alignment", asked.values(asked.notable))
    gained = maximise(base.scene, added, start=fitted.x, rounds=0).log_p - fitted.log_p
    scores = Screen(scene=base.scene, fitted=fitted).heading_scores(base.scene, asked)
    known = np.isfinite(gained)
    likely = np.tanh(asked.notable * scores[known])
    assert np.corrcoef(likely, np.tanh(gained[known]))[0, 1] > 0.8


def test_a_component_about_another_way_below_zero_is_asked_on_both_sides(screen, candidate):
    """Of fish drawn back from their last turn the score is that of headings drawn back.

    They are not merely drawn on less: that says next to nothing of the headings drawn back. The
    side is the effect's own, so that it is asked alike where the model has it.
    """
    own = screen(29, {"turning-memory": {"strength": -1.5, "drawn": 1.0}})
    on, back = both_sides(candidate("turning-memory", drawn=1.0))
    assert (on.asked_at, back.asked_at) == (on.notable, -on.notable)
    score, model = own.ask(back), own.fitted.parameters
    assert score.clearness > 5 > own.ask(on).clearness
    assert score.strength < 0
    added = with_effect(model, "turning-memory", back.values(back.asked_at))
    gained = maximise(own.scene, added, start=own.fitted.x, rounds=0).log_p - own.fitted.log_p
    scores, known = own.heading_scores(own.scene, back), np.isfinite(gained)
    likely = np.tanh(back.asked_at * scores[known])
    assert np.corrcoef(likely, np.tanh(gained[known]))[0, 1] > 0.8
    again = candidate_of("turning-memory", back.values(-0.2))
    assert again == back
    assert refit(own, score).values["strength"] == pytest.approx(-1.5, rel=0.3)
    assert candidate_of("turning-memory", on.values(0.2)).asked_at == on.asked_at


def test_what_has_no_component_has_no_sides(candidate):
    """A tilt below zero is less of the same, and nothing is drawn on the other side of none."""
    for name in ("turning-memory", "collective-departure", "alignment"):
        assert both_sides(candidate(name)) == (candidate(name),)
    assert candidate_of("turning-memory", {"strength": -1.0}).side == 0


def test_less_than_none_of_a_component_is_no_evidence_for_it(screen, candidate):
    """Where fish are drawn on, the side on which they would be drawn back is not clear."""
    own = screen(31, {"turning-memory": {"strength": 1.5, "drawn": 1.0}})
    on, back = (own.ask(each) for each in both_sides(candidate("turning-memory", drawn=1.0)))
    assert on.clearness > 5 > back.clearness


def test_a_mirrored_bias_has_the_other_sign(screen, candidate):
    """Left and right differ by nothing else: like sizes of z, other signs."""
    left = screen(23, {"turning-bias": {"strength": 0.4}}).ask(candidate("turning-bias"))
    right = screen(23, {"turning-bias": {"strength": -0.4}}).ask(candidate("turning-bias"))
    assert left.z > 10 > -10 > right.z
    assert left.strength == pytest.approx(0.4, rel=0.3)
    assert right.strength == pytest.approx(-0.4, rel=0.3)


def test_boldness_is_how_individuals_scatter(screen, candidate):
    """Fish of one kind do not scatter; those with a spread of 0.7 do, by about as much."""
    alike, unlike = (
        screen(31, effects).ask(candidate("boldness"))
        for effects in (None, {"boldness": {"spread": 0.7}})
    )
    assert abs(alike.z) < 3.5
    assert unlike.z > 8
    assert unlike.strength == pytest.approx(0.7, rel=0.35)


def test_a_lone_fish_does_not_scatter(screen, candidate):
    """One individual differs from nobody."""
    assert screen(3, n_fish=1, minutes=5.0).ask(candidate("boldness")).z == 0.0


def test_fish_that_stop_are_told_from_slow_ones(screen, candidate):
    """Rests go on: staying after staying is more frequent than staying after moving."""
    own = screen(41, {"freezing": {"rate_per_s": 0.02, "duration_s": 2.0}}, minutes=6.0)
    now, before = own.still
    assert now[before].mean() > 3 * now[~before].mean()
    assert own.ask(candidate("freezing")).z > 8


def test_the_model_divides_its_effects_out_of_speeds(screen, candidate, base):
    """Without an effect on speed they are the measured ones."""
    assert np.array_equal(base.own_speeds, base.scene.moves.speed_m_s)


def test_information_is_that_of_the_strength(base, tank):
    """One over its squared error, for speeds as for headings: so many errors are z.

    A score that rests on few steps counts for less; individuals and rests have no sign.
    """
    asked = [each for each in family(base, tank) if each.name not in {"boldness", "freezing"}]
    for score in ask_all(base, asked, 1):
        errors = abs(score.strength) * math.sqrt(score.information)
        assert errors > 0.999 * abs(score.z)
        if score.candidate.effect.on_speed:
            assert errors == pytest.approx(abs(score.z), rel=1e-6)


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("burst-and-coast", {}),
        ("crowding", {}),
        ("turning-bias", {"along_walls": 0.0}),
        ("freezing", {"duration_s": 2.0}),
    ],
)
def test_a_faint_effect_shows_as_the_information_of_a_right_model_says(
    screen, candidate, name, shape
):
    """By half to twice so many standard errors: what `minutes_needed` is taken from."""
    own = candidate(name, **shape)
    without = screen(61, minutes=8.0).ask(own)
    expected = own.faint * math.sqrt(without.information)
    found = screen(62, {name: own.values(own.faint)}, minutes=8.0).ask(own)
    assert 0.5 * expected < found.z < 2.0 * expected


def test_workers_do_not_change_numbers(base, tank):
    """One thread or three: the same z, in the order of the candidates."""
    asked = family(base, tank)[:12]
    one, three = (ask_all(base, asked, n) for n in (1, 3))
    assert [s.z for s in one] == [s.z for s in three]
    assert [s.candidate for s in one] == list(asked)


def test_a_score_by_hand(candidate):
    """A hundred times 1, 2, -1: sum 200, squares 600; z is 200 / sqrt 600, a Newton step 1/3."""
    score = summed(candidate("turning-bias"), np.tile([1.0, 2.0, -1.0], 100))
    assert score.z == pytest.approx(200 / math.sqrt(600))
    assert score.strength == pytest.approx(1 / 3)
    assert score.information == pytest.approx(600.0)


def test_a_few_steps_that_make_up_all_count_for_less(candidate):
    """Six steps of one size, where sixty would be as good as normal: z times sqrt(6 / 60)."""
    scores = np.zeros(1000)
    scores[:6] = 2.0
    score = summed(candidate("turning-bias"), scores)
    assert score.z == pytest.approx(math.sqrt(6) * math.sqrt(0.1))


def test_nothing_asked_is_nothing_answered(candidate):
    """Scores that are all zero, as without a robot, have z zero and no information."""
    score = summed(candidate("turning-bias"), np.zeros(5))
    assert (score.z, score.strength, score.information) == (0.0, 0.0, 0.0)


def test_sums_by_track():
    """In ascending order of the ids."""
    sums, squares = by_track(np.array([7, 3, 7], dtype=np.int32), np.array([1.0, 2.0, 3.0]))
    assert sums.tolist() == [2.0, 4.0]
    assert squares.tolist() == [4.0, 10.0]


def test_one_wild_value_is_tamed():
    """Set to eight standard deviations; nothing at all stays nothing."""
    values = np.zeros(1000)
    values[0] = 100.0
    assert tame(values)[0] == pytest.approx(8 * values.std())
    assert tame(np.zeros(0)).size == 0


def test_each_zone_has_its_own_mean():
    """What is not kept counts for no mean and is zero."""
    zone = np.array([1, 1, 2, 2, 2])
    kept = np.array([True, True, True, True, False])
    rest = centred(np.array([1.0, 3.0, 10.0, 20.0, 99.0]), zone, kept)
    assert rest.tolist() == [-1.0, 1.0, -5.0, 5.0, 0.0]


def test_rests_count_however_few_there_are():
    """Twelve where 0.6 were to be expected are clear; thirty where there were to be 30 are not.

    Too few of them are negative, and next to nothing expected is no proof of anything.
    """
    assert excess_deviate(12.0, 0.6) > 6.0
    assert excess_deviate(30.0, 30.0) == 0.0
    assert excess_deviate(10.0, 30.0) < -3.0
    assert excess_deviate(0.0, 2.0) == pytest.approx(-2.0)
    assert excess_deviate(3.0, 0.0) == 0.0
    assert excess_deviate(5000.0, 10.0) > 30.0


def test_a_surplus_of_rests_is_no_more_frequent_than_it_says():
    """Poisson counts of mean 3: beyond 2 standard errors at most as often as in a normal law."""
    counts = np.random.default_rng(5).poisson(3.0, 20_000)
    z = np.array([excess_deviate(float(n), 3.0) for n in range(counts.max() + 1)])[counts]
    assert (z > 2.0).mean() < 0.023


def test_a_room_in_which_fish_swim_faster_is_one_place(worlds, tank):
    """By a tenth in the upper left half: no narrow place stands out as a wide one does."""
    scene, fitted = worlds.fitted_scene(worlds.base_walk(13, minutes=10))
    moves = scene.moves
    x, y = (scene.states[moves.at, row, moves.who] for row in (X, Y))
    speed = moves.speed_m_s * np.where(y > x, 1.1, 1.0)
    lit = dataclasses.replace(scene, moves=dataclasses.replace(moves, speed_m_s=speed))
    own = Screen(scene=lit, fitted=fitted)
    shapes = candidates_of((find_effect("generic:speed:place"),), tank)

    z = np.array([abs(own.ask(each).z) for each in shapes])

    wide = np.array([each.shape["reach_m"] > 0.3 for each in shapes])
    assert z[wide].max() > 8.0
    assert z[~wide].max() < 0.85 * z[wide].max()


def test_a_lit_room_is_no_crowding(screen, candidate):
    """Where fish gather in it they are fast in company; within a field of the tank they are not."""
    lit = {"generic:speed:place": {"strength": 0.4, "x_m": 0.22, "y_m": 0.78, "reach_m": 0.35}}
    own = screen(40, lit)
    place = candidate("generic:speed:place", x_m=0.22, y_m=0.78, reach_m=0.35)
    crowding = candidate("crowding", radius_m=0.35)
    assert own.ask(place).z > 20
    assert abs(own.ask(crowding).z) < 3
    shy = screen(40, {"crowding": {"per_neighbour": 0.1, "radius_m": 0.35}})
    assert shy.ask(crowding).z > 8
