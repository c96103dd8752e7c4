"""The law of each step as features see it: the fitted one, and what is added to it."""

import dataclasses
import math
import threading
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.special import i0e, ndtr

from zfcal.diagnose.features.draws import Sight, Steps, _turned_back, draw_of, errors_of
from zfcal.diagnose.features.kernels import attractions, bells, bells_on_cells, tilted
from zfcal.diagnose.features.landings import leaned
from zfcal.diagnose.features.law import DRAWS, Law
from zfcal.diagnose.features.waves import WAVES, series_of, waves_of
from zfcal.model.directions import turned_by
from zfcal.model.effects import find_effect
from zfcal.model.effects.weights import attended, evenly, precision_of_attention
from zfcal.model.extended import maximise, with_effect
from zfcal.model.features import LAGS, SOON, Component, Sharper, Tilt, Turned
from zfcal.model.histories import ago_heading, recent_turn, straight
from zfcal.model.kernels.perception import REPULSION_M
from zfcal.model.kernels.state import HX, HY, PAST_HX, PAST_HY, STATES, TAU_X, TAU_Y, ZONE, X, Y
from zfcal.model.scene import make_scene


@pytest.fixture(scope="module")
def law(base):
    """Return that of ten minutes of fish that do as the base model does."""
    scene, fitted = base
    return Law(scene=scene, fitted=fitted)


def log_p_of(law):
    """Return log densities by the law's own columns."""
    at, over = (column[:, 0] for column in law.base)
    density = np.exp(law.log_here) * at / over
    lapse = law.lapses.usual
    return np.log((1 - lapse) * density + lapse / (2 * math.pi))


def test_the_law_is_the_fitted_one(law):
    """The same density of each heading taken, to the digits of the exponential."""
    np.testing.assert_allclose(log_p_of(law), law.fitted.log_p[law.rows], atol=1e-6)


@pytest.mark.parametrize(
    "effects",
    [
        {"alignment": {"weight": 8.0}},
        {"directional-drift": {"strength": 0.5, "direction_rad": 1.0}},
        {"directional-drift": {"strength": 0.05, "direction_rad": 1.0, "drawn": 1.0}},
        {"rear-blind-zone": {}},
        {"alignment": {"weight": 5.0, "turning": 1.0}},
        {"alignment": {"weight": 5.0}, "group-cohesion": {"weight": 2.0, "turning": 2.0}},
    ],
    ids=str,
)
def test_the_law_of_a_model_with_effects_is_the_fitted_one(base, effects):
    """Components, tilts, sight and turns of its directions are in it."""
    scene, plain = base
    model = plain.parameters
    for name, values in effects.items():
        full = dict(zip(find_effect(name).names, find_effect(name).values(values), strict=True))
        model = with_effect(model, name, full)
    fitted = maximise(scene, model, start=plain.x, rounds=0)
    law = Law(scene=scene, fitted=fitted)
    np.testing.assert_allclose(log_p_of(law), fitted.log_p[law.rows], atol=1e-6)


def test_the_cells_add_up_to_the_integral(law):
    """The law on cells, attraction included, is what the columns integrate."""
    np.testing.assert_allclose(law.cells.sum(axis=1), law.base[1][:, 0], rtol=1e-6)


def test_von_mises_laws_by_plain_numpy():
    """At the heading taken and over weighted cells; no source gives nothing."""
    rng, cells = np.random.default_rng(2), 72
    angle = rng.uniform(-np.pi, np.pi, (5, 2))
    toward = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    toward[0, 1] = 0.0
    kappa, weight = np.array([0.0, 0.7, 9.0, 20.0, 120.0]), rng.random((5, cells))
    ways = rng.uniform(-np.pi, np.pi, 5)
    taken = np.stack([np.cos(ways), np.sin(ways)], axis=-1)
    at, over = np.empty((5, 2)), np.empty((5, 2))
    bells(toward, kappa, *series_of(kappa), waves_of(weight), weight, taken, at, over)
    grid = 2 * np.pi * np.arange(cells) / cells
    plain = np.exp(kappa[:, None, None] * (np.cos(grid - angle[..., None]) - 1))
    plain[0, 1] = 0.0
    np.testing.assert_allclose(over, (plain * weight[:, None]).sum(axis=-1), rtol=1e-6)
    here = np.exp(kappa[:, None] * (np.cos(ways[:, None] - angle) - 1))
    here[0, 1] = 0.0
    np.testing.assert_allclose(at, here, rtol=1e-6, atol=1e-12)
    share = rng.random((5, 2))
    found = np.zeros((5, cells))
    bells_on_cells(toward, kappa, share, found)
    np.testing.assert_allclose(found, (share[..., None] * plain).sum(axis=1), rtol=1e-6)


@pytest.mark.parametrize("kappa", [20.0, 60.0, 120.0])
def test_what_hardly_lands_inside_is_as_exact(kappa):
    """Cells within 60 degrees of the direction lie outside, where a series would cancel."""
    angle = np.linspace(-np.pi, np.pi, 50)
    toward = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]
    grid = 2 * np.pi * np.arange(72) / 72
    apart = np.abs((grid - angle[:, None] + np.pi) % (2 * np.pi) - np.pi)
    weight = np.where(apart < math.radians(60), 0.0, 0.7)
    k = np.full(50, kappa)
    at, over = np.empty((50, 1)), np.empty((50, 1))
    bells(toward, k, *series_of(k), waves_of(weight), weight, toward[:, 0].copy(), at, over)
    expected = (weight * np.exp(kappa * (np.cos(apart) - 1))).sum(axis=1)
    np.testing.assert_allclose(over[:, 0], expected, rtol=1e-4)
    assert (over > 0).all()


@pytest.mark.parametrize("cells", [64, 7])
def test_waves_by_plain_numpy(cells):
    """Also where there are more waves than cells, of any number of these."""
    weight = np.random.default_rng(6).random((3, cells))
    angle = 2 * np.pi * np.outer(np.arange(WAVES), np.arange(cells)) / cells
    found = waves_of(weight)
    np.testing.assert_allclose(found[..., 0], weight @ np.cos(angle).T, atol=1e-12)
    np.testing.assert_allclose(found[..., 1], weight @ np.sin(angle).T, atol=1e-12)


def test_tilts_by_plain_numpy():
    """The integral of the density times the factor, and the mean heading under it."""
    rng, cells = np.random.default_rng(4), 64
    density, vector = rng.random((3, cells)), rng.normal(0, 1, (3, 2))
    grid = 2 * np.pi * np.arange(cells) / cells
    ways = np.stack([np.cos(grid), np.sin(grid)], axis=-1)
    plain = density * np.exp(vector @ ways.T)
    whole, mean = np.empty(3), np.empty((3, 2))
    tilted(density, ways, vector, whole, mean)
    np.testing.assert_allclose(whole, plain.sum(axis=1))
    np.testing.assert_allclose(mean, plain @ ways / plain.sum(axis=1)[:, None])


def test_strong_tilts_are_as_exact_as_weak_ones():
    """Of none the integral is that of the density itself; of forty nats it is still exact."""
    density, grid = np.random.default_rng(4).random((3, 64)), 2 * np.pi * np.arange(64) / 64
    ways = np.stack([np.cos(grid), np.sin(grid)], axis=-1)
    vector = np.array([[0.0, 0.0], [0.0, -20.0], [-24.0, 32.0]])
    whole, mean = np.empty(3), np.empty((3, 2))
    tilted(density, ways, vector, whole, mean)
    plain = density * np.exp(vector @ ways.T)
    np.testing.assert_allclose(whole, plain.sum(axis=1), rtol=1e-6)
    assert whole[0] == pytest.approx(density[0].sum(), rel=1e-14)


def test_the_attraction_of_a_cell_by_plain_numpy():
    """Of all zones that it lands in, and of the one that is asked for."""
    rng = np.random.default_rng(5)
    share, gamma = rng.integers(0, 5, (4, 64, 3), dtype=np.uint8), rng.random((4, 3))
    whole, own = attractions(share, gamma, 2)
    np.testing.assert_allclose(whole, np.einsum("sgz,sz->sg", share, gamma))
    np.testing.assert_allclose(own, share[..., 2] * gamma[:, 2:])


def test_a_component_over_an_even_tank_integrates_to_its_weight(law):
    """Where all headings land in one zone the integral of a density is that zone's attraction."""
    feature = Component(
        label="east",
        toward=lambda seen: np.broadcast_to([1.0, 0.0], (len(seen.zone), 1, 2)),
        weights=lambda seen: np.full((len(seen.zone), 1, 1), 0.3),
        kappa=4.0,
    )
    at, over = law.component(feature)
    share = law.turns.share
    even = (share.max(axis=2) == share.sum(axis=2).max()).all(axis=1)
    even &= (share.argmax(axis=2) == share.argmax(axis=2)[:, :1]).all(axis=1)
    gamma = law.weight.sum(axis=1) / (2 * math.pi)
    assert even.sum() > 100
    np.testing.assert_allclose(over[even, 0], 0.3 * gamma[even], rtol=1e-6)
    east = np.exp(4 * (law.turns.taken[:, 0] - 1)) / (2 * math.pi * i0e(4.0))
    np.testing.assert_allclose(at[:, 0], 0.3 * east, rtol=1e-6)


def test_a_turn_of_the_directions_is_a_derivative(law):
    """Of the base's law, by the angle: as a difference quotient of a tenth of the angle is."""
    whole = Turned(label="x", by=lambda seen: np.ones(len(seen.zone)), neighbours=True)
    own = Turned(label="x", by=lambda seen: np.ones(len(seen.zone)), neighbours=False)
    at, over = law.turned(whole)
    assert at.shape == over.shape == (len(law.rows), 1)
    assert np.abs(law.turned(own)[0] - at).max() > 0.01
    # All headings alike, in a tank without walls near: turned, the integral stays as it is.
    share = law.turns.share
    even = (share.argmax(axis=2) == share.argmax(axis=2)[:, :1]).all(axis=1)
    even &= (share.sum(axis=2) == share.sum(axis=2).max()).all(axis=1)
    assert np.abs(over[even]).max() < 1e-4 * law.base[1][even].max()


def test_sharper_steps_have_a_larger_concentration(law):
    """A tenth of it at a strength of one, as in the law of such a model."""
    columns = law.sharper(Sharper(label="x", by=lambda seen: np.ones((len(seen.zone), 1))))
    more = dataclasses.replace(law)
    more.__dict__.update(law.__dict__, kappa_own=1.1 * law.kappa_own)
    for one in ("own", "base", "_own_sharper"):
        more.__dict__.pop(one, None)
    for made, own, expected in zip(columns, law.own, more.own, strict=True):
        np.testing.assert_allclose(made, expected - own, atol=1e-12)


def test_exact_positions_have_one_draw_and_noisy_ones_several(base):
    """Draws differ from each other; their mean is near the law at the measured positions."""
    scene, fitted = base
    exact, noisy = (Law(scene=scene, fitted=fitted, noise_m=noise) for noise in (0.0, 2e-4))
    assert (len(exact.draws), len(noisy.draws)) == (1, DRAWS)
    first, second = noisy.draws[0].seen, noisy.draws[1].seen
    assert not np.array_equal(first.bearing, second.bearing)
    np.testing.assert_array_equal(first.speed_m_s, exact.draws[0].seen.speed_m_s)
    apart = log_p_of(noisy) - log_p_of(exact)
    assert 0 < np.abs(apart).mean() < 0.05


@pytest.mark.slow
def test_draws_are_the_same_for_a_seed(base):
    """And others for another one."""
    scene, fitted = base
    some = [Law(scene=scene, fitted=fitted, noise_m=5e-4, seed=s).base[0] for s in (1, 1, 2)]
    np.testing.assert_array_equal(some[0], some[1])
    assert not np.array_equal(some[0], some[2])


def test_directions_of_a_draw_are_turned_back_to_the_heading_taken(law):
    """In a tank that is turned as a whole all is seen as before: the heading taken is the same."""
    angle, scene = 0.7, law.scene
    states = scene.states.copy()
    for x, y in ((X, Y), (HX, HY), (PAST_HX, PAST_HY), (TAU_X, TAU_Y)):
        way = turned_by(np.stack([scene.states[:, x], scene.states[:, y]], axis=-1), angle)
        states[:, x], states[:, y] = way[..., 0], way[..., 1]
    view = dataclasses.replace(law.fitted.view, toward=turned_by(law.fitted.view.toward, angle))
    steps = Steps(
        scene=scene, parameters=law.fitted.parameters, rows=law.rows, turns=law.turns,
        follows=law.follows, alpha=law.alpha,
    )  # fmt: skip
    found, plain = draw_of(steps, states, view), law.draws[0]
    for name in (
        "toward",
        "soon_toward",
        "half_toward",
        "bearing",
        "heading",
        "own_heading",
    ):
        np.testing.assert_allclose(getattr(found.seen, name), getattr(plain.seen, name), atol=1e-9)
    for ago in (SOON, 0.5, 1.0, 2.0):
        late, as_before = (seen.sight_ago(ago) for seen in (found.seen, plain.seen))
        np.testing.assert_allclose(late, as_before, atol=1e-9)
    for steps in (SOON, *LAGS):
        for name in ("ago_toward", "then_toward"):
            ways, as_before = (getattr(seen, name)(steps) for seen in (found.seen, plain.seen))
            np.testing.assert_allclose(ways, as_before, atol=1e-9)
    for name in ("base", "toward", "angle_sr"):
        np.testing.assert_allclose(getattr(found, name), getattr(plain, name), atol=1e-9)
    np.testing.assert_allclose(found.seen.off_axis_rad, plain.seen.off_axis_rad, atol=1e-7)


def test_a_draw_keeps_what_was_seen_and_nothing_that_it_was_made_from(law):
    """Neither all states nor directions before they were turned: eight draws would hold them."""
    scene = law.scene
    states = scene.states.copy()
    states[:, X] += 1e-4 * np.sin(np.arange(len(states)))[:, None]
    steps = Steps(
        scene=scene, parameters=law.fitted.parameters, rows=law.rows, turns=law.turns,
        follows=law.follows, alpha=law.alpha,
    )  # fmt: skip
    seen = draw_of(steps, states, law.fitted.view).seen
    kept = weakref.ref(states)
    del states
    assert kept() is None
    held = held_by([getattr(seen, field.name) for field in dataclasses.fields(seen)])
    assert len(held) > 25
    # Of a step and each other one a few numbers: all of the states would be 26 of each step.
    assert max(each.size for each in held) <= 2 * len(LAGS) * len(seen.zone)
    before = dataclasses.replace(seen, bearing=seen.bearing.copy())
    turned, kept = _turned_back(before, np.full(len(seen.zone), 0.3)), weakref.ref(before.bearing)
    del before
    assert kept() is None
    assert np.isfinite(turned.ago_toward(1.0)).all()
    assert np.isfinite(turned.sight_ago(1.0)).all()


def held_by(values):
    """Return the arrays that some values hold, those that functions close over as well."""
    found, left, met = [], list(values), set()
    while left:
        value = left.pop()
        if id(value) in met:
            continue
        met.add(id(value))
        if isinstance(value, np.ndarray):
            # Of a view what it is of; kernels have their own owners.
            found.append(value.base if isinstance(value.base, np.ndarray) else value)
        left += [cell.cell_contents for cell in getattr(value, "__closure__", None) or ()]
        left += [value.__wrapped__] if hasattr(value, "__wrapped__") else []
    return found


def test_what_was_seen_is_kept_where_positions_are_exact(law):
    """Of the one draw that there is then; of many attention alone."""
    seen = law.draws[0].seen
    assert seen.sight_ago(1.0) is seen.sight_ago(1.0)
    noisy = dataclasses.replace(law, noise_m=5e-4, n_draws=2, every=8).draws[0].seen
    assert noisy.sight_ago(1.0) is not noisy.sight_ago(1.0)
    assert noisy.attention_ago(1.0) is noisy.attention_ago(1.0)


def test_who_is_too_near_is_left_from_where_it_was(law):
    """And from where it is where that is not known; all others draw to where they were."""
    seen, turns, states = law.draws[0].seen, law.turns, law.scene.states
    n = states.shape[2]
    others = np.array([[j for j in range(n) if j != i] for i in range(n)])[turns.who]
    before = np.maximum(turns.at - 1, 0)[:, None]
    xy = np.stack([states[before, row, others] for row in (X, Y)], axis=-1)
    way = xy - seen.xy_m[:, None]
    way /= np.maximum(np.linalg.norm(way, axis=-1), 1e-12)[..., None]
    known = (states[before, ZONE, others] > 0) & seen.here & (turns.at > 0)[:, None]
    assert 10 < (known & seen.too_near).sum() < 0.2 * known.sum()
    for is_near, sign in ((seen.too_near, -1), (~seen.too_near, 1)):
        some = known & is_near
        np.testing.assert_allclose(seen.ago_toward(1)[some], sign * way[some], atol=1e-9)
    unknown = seen.too_near & ~known & (seen.attention > 0)
    np.testing.assert_allclose(seen.ago_toward(1)[unknown], seen.toward[unknown], atol=1e-9)
    assert not (seen.too_near & ~seen.here).any()


def test_others_come_into_view_late(law):
    """Who is seen now and was not a tenth of a step ago is rarer than half a step ago, or a step.

    Nobody is lost of whom both are true.
    """
    seen = law.draws[0].seen
    new = [
        float(((seen.attention > 0) & (seen.attention_ago(steps) == 0)).mean())
        for steps in (SOON, 0.5, 1.0)
    ]
    assert 0 < new[0] < new[1] < new[2] < 0.2
    soon = seen.attention_ago(SOON)
    both = (seen.attention > 0) & (soon > 0)
    ratio = np.log(soon[both] / seen.attention[both])
    assert np.abs(np.median(ratio)) < 0.05


def test_recent_turns_are_remembered_the_later_the_more():
    """A fish that turns by 0.5 at each step, and one that turned round two steps ago."""
    angle = np.array([[0.5 * k, 0.0 if k < 4 else math.pi] for k in range(7)])
    states = np.zeros((7, STATES, 2))
    states[:, HX], states[:, HY], states[:, ZONE] = np.cos(angle), np.sin(angle), 1.0
    at, who = np.array([6, 6, 0]), np.array([0, 1, 0])
    weights = 0.6 ** np.arange(5) / (0.6 ** np.arange(5)).sum()
    expected = [0.5, 1.2 * weights[2], 0.0]
    np.testing.assert_allclose(np.abs(recent_turn(states, at, who)), expected, atol=1e-12)
    states[4, ZONE] = 0.0
    expected = [0.5 * weights[:1].sum(), 0.0, 0.0]
    np.testing.assert_allclose(np.abs(recent_turn(states, at, who)), expected, atol=1e-12)


def test_a_law_without_some_zone_leaves_its_turns_out(base):
    """Where too few turns start nothing is fitted: these have no columns."""
    scene, fitted = base
    log_p = fitted.log_p.copy()
    log_p[scene.turns.zone == 1] = np.nan
    some = Law(scene=scene, fitted=dataclasses.replace(fitted, log_p=log_p))
    assert (some.turns.zone != 1).all()
    assert len(some.base[0]) == len(some.rows) < len(scene.turns)


def test_a_factor_is_taken_in_and_what_was_seen_is_kept(base):
    """Twice half a factor is a whole one; draws are not made anew."""
    scene, fitted = base
    law = Law(scene=scene, fitted=fitted, noise_m=5e-4, n_draws=2)
    rng = np.random.default_rng(2)
    tilt = Tilt(label="x", vectors=lambda seen: seen.own_heading[:, None])
    leaning, leaving = rng.normal(0, 0.1, (len(law.rows), 2)), rng.normal(0, 0.1, len(law.rows))
    once = law.absorbing(bent=leaned(law, tilt, leaning), leaving=(law.between, leaving))
    half = law.absorbing(bent=leaned(law, tilt, leaning / 2))
    twice = half.absorbing(bent=leaned(law, tilt, leaning / 2), leaving=(law.between, leaving))
    assert twice.draws is law.draws
    np.testing.assert_allclose(once.cells, twice.cells)
    np.testing.assert_allclose(once.log_here, twice.log_here)
    assert not np.allclose(once.cells, law.cells)
    # By hand: the factor at the heading taken, and that of the zone of landing.
    by_hand = law.log_here + (leaning * law.turns.taken).sum(axis=1)
    by_hand += leaving * (law.turns.landing == law.between)
    np.testing.assert_allclose(once.log_here, by_hand)


def test_what_was_seen_is_worked_out_once_whoever_asks():
    """By many at the same time; what failed is tried again."""
    made, begun = [], threading.Barrier(4)

    def make():
        made.append(len(made))
        if len(made) == 1:
            raise MemoryError
        return made[-1]

    sight = Sight(make)
    with pytest.raises(MemoryError):
        _ = sight.seen

    def ask(_number):
        begun.wait(timeout=9)
        return sight.seen

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(ask, range(4))) == [1] * 4
    assert made == [0, 1]


def test_errors_of_draws_are_those_of_a_latin_hypercube(screen):
    """Each coordinate has every eighth of the normal law once, in an order of its own."""
    scene = screen(5).scene
    errors = errors_of(8, scene, np.random.default_rng(3))
    assert errors.shape == (8, len(scene.k), scene.states.shape[2], 2)
    parts = np.sort((8 * ndtr(errors)).astype(int).reshape(8, -1), axis=0)
    np.testing.assert_array_equal(parts, np.repeat(np.arange(8)[:, None], parts.shape[1], axis=1))
    assert (errors**2).mean() == pytest.approx(1.0, abs=0.01)
    assert abs((errors[..., 0] * errors[..., 1]).mean()) < 0.01


@pytest.fixture(scope="module", params=[False, True], ids=["all there", "some come and go"])
def crowd(request, record, tank, fish):
    """Return the law of fish of which some may not be there all the time, and whether they are."""
    samples = record(5)
    xy_m = samples.xy_m.copy()
    if request.param:
        xy_m[:50, 1] = xy_m[100:120, 2] = np.nan
    scene = make_scene(dataclasses.replace(samples, xy_m=xy_m), tank)
    return Law(scene=scene, fitted=maximise(scene, fish, rounds=0)), request.param


@pytest.mark.parametrize("steps", [0.5, 1.0, 2.0, 2.25])
def test_others_draw_to_where_they_were_and_away_from_who_was_too_near(crowd, steps):
    """By whole steps, and in a straight line between these; to where one is who was not there."""
    law, comes = crowd
    whole, share = int(steps), steps % 1
    seen, at, who, states = law.draws[0].seen, law.turns.at, law.turns.who, law.scene.states
    found, n_near, n_away = seen.shortly_ago_toward(steps), 0, 0
    for s in range(0, 2000, 3):
        others = [j for j in range(states.shape[2]) if j != who[s]]
        ends = [states[max(at[s] - k, 0)][:, others] for k in (whole, whole + (share > 0))]
        away = ((1 - share) * ends[0] + share * ends[1])[[X, Y]].T - states[at[s], [X, Y], who[s]]
        far = np.hypot(*away.T)
        there = (ends[0][ZONE] > 0) & (ends[1][ZONE] > 0) & seen.here[s]
        n_near += (far[there] < REPULSION_M).sum()
        n_away += (seen.here[s] & ~there).sum()
        expected = np.where(far < REPULSION_M, -1.0, 1.0)[:, None] * away / far[:, None]
        np.testing.assert_allclose(found[s, there], expected[there], atol=1e-9)
        np.testing.assert_array_equal(found[s, ~there], seen.toward[s, ~there])
    assert n_near > 0
    assert bool(n_away) is comes


def test_headings_of_steps_before_are_known_up_to_a_gap(base):
    """The last step's is the heading before; before a gap, and before the first sample, none is."""
    scene, fitted = base
    law = Law(scene=scene, fitted=fitted)
    seen, at, who = law.draws[0].seen, law.turns.at, law.turns.who
    then = scene.states[np.maximum(at - 1, 0), :, who][:, [HX, HY]]
    known = at >= 1
    np.testing.assert_array_equal(seen.ago_heading[0][known], np.nan_to_num(then[known]))
    gone = scene.states.copy()
    gone[20, ZONE] = 0
    found = ago_heading(gone, np.array([22, 22, 25]), np.array([0, 1, 0]))
    assert found[LAGS.index(1)].any(axis=1).all()
    assert not found[LAGS.index(2), :2].any()
    assert found[LAGS.index(4), 2].any()
    assert not found[LAGS.index(5), 2].any()


def test_fish_swim_straight_since_their_last_wide_turn(base):
    """Or since they came: no turn since was wide, and rest does not count."""
    scene, fitted = base
    law = Law(scene=scene, fitted=fitted)
    seen, at, who = law.draws[0].seen, law.turns.at, law.turns.who
    n_steps = np.round(seen.straight_s / scene.dt_s).astype(int)
    assert 0 < (n_steps == 0).sum() < 0.6 * len(n_steps)
    size = np.abs(seen.last_turn_rad)
    assert (n_steps[size > 0.6] == 0).all()
    assert (n_steps[(size > 1e-9) & (size < 0.6)] > 0).all()
    for k in range(4):
        some = n_steps > k
        now, before = (
            scene.states[at[some] - ago, :, who[some]][:, [HX, HY]] for ago in (k, k + 1)
        )
        assert ((now * before).sum(axis=1) > np.cos(0.6)).all()
    gone = scene.states.copy()
    gone[20, ZONE] = 0
    since = np.round(straight(gone, scene.dt_s) / scene.dt_s).astype(int)
    assert (since[21] == 0).all()
    assert (since[25] <= 4).all()
    resting = np.repeat(scene.states[30:31], 4, axis=0)
    assert not straight(resting, scene.dt_s).any()


def test_what_is_drawn_turns_with_the_whole_law(base):
    """Where an effect turns all directions, features of attention are about these.

    So what takes the place of neighbours takes away the very components that the law has of them.
    """
    scene, plain = base
    given = {"strength": 4.0, "direction_rad": 1.0, "turning": 2.0}
    model = with_effect(plain.parameters, "directional-drift", given)
    law = Law(scene=scene, fitted=maximise(scene, model, start=plain.x, rounds=0))
    own = Component(
        label="as seen", toward="toward", weights=attended(evenly), kappa="neighbours"
    )  # fmt: skip
    for made, known in zip(law.component(own), law._neighbours(), strict=True):
        np.testing.assert_allclose(made, known, rtol=1e-6, atol=1e-9)


def test_precision_of_attention_is_the_derivative_of_the_law_by_its_concentration(base):
    """Of all that is seen alike it is what the base's own concentration about neighbours adds."""
    scene, fitted = base
    law = Law(scene=scene, fitted=fitted)
    made = law.component(precision_of_attention(evenly, "precision"))
    for found, sharper, usual in zip(made, law._neighbours(1.1), law._neighbours(), strict=True):
        np.testing.assert_allclose(found, sharper - usual, atol=1e-12)
        assert np.abs(found).max() > 1e-3
