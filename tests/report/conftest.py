"""Views of trials made up in memory, a small trial on disk, and eyes for figures."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from matplotlib.axes import Axes
from matplotlib.text import Text

from zfcal.arena import Zone, make_arena
from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import write_model
from zfcal.artifacts.settings import write_trial
from zfcal.artifacts.tables import make_table, write_table, write_tracks
from zfcal.behaviour.located import locate
from zfcal.behaviour.rows import statistics_to_rows
from zfcal.behaviour.statistics import measure, measure_robot
from zfcal.parameters import gene_names, natural
from zfcal.report.figures import theme
from zfcal.report.figures.panels import compose
from zfcal.report.followed import followed_from
from zfcal.report.page import write_report
from zfcal.report.seen import see, visits_of
from zfcal.report.views import (
    FEATURE_NAMES,
    MODEL,
    ROBOT,
    SOCIAL,
    Course,
    Integration,
    Mark,
    Round,
    TrialView,
)
from zfcal.tracks import FISH, Samples, Tracks
from zfcal.trial import Trial

DT_S = 0.2
FPS = 15.0


@pytest.fixture(scope="session")
def holed():
    """A long tank of one's own with two holes and two zones of odd names."""
    outline = shapely.box(0, 0, 2, 0.8) - shapely.box(0.5, 0.3, 0.7, 0.5)
    outline -= shapely.Point(1.4, 0.4).buffer(0.15)
    feeding = shapely.box(1.7, 0.1, 1.95, 0.5)
    shelter = shapely.box(0.05, 0.55, 0.35, 0.78)
    return make_arena(
        name="my $tank$ <b>",
        outline=outline,
        zones=(
            Zone(name="feeding place", follows_walls=False, polygon=feeding),
            Zone(name="shelter & plants", follows_walls=True, polygon=shelter),
        ),
    )


@pytest.fixture(scope="session")
def arenas(holed):
    """All arenas that come with zfcal, and two that do not."""
    names = ("two-rooms", "open-square", "circular", "ring")
    narrow = make_arena(name="narrow", outline=shapely.box(0, 0, 0.1, 0.9), wall_zone_m=0.02)
    return {name: load_arena(name, Path()) for name in names} | {"own": holed, "narrow": narrow}


@pytest.fixture(scope="session")
def two_rooms(arenas):
    """The arena of the paper."""
    return arenas["two-rooms"]


@pytest.fixture(scope="session")
def wander():
    """Return what makes samples of agents that wander about an arena, the last one a robot."""

    def make(arena, *, n=5, n_samples=600, robot=True, seed=1, first_k=0):
        rng = np.random.default_rng(seed)
        x0, y0, x1, y1 = arena.outline.bounds
        inside = rng.uniform((x0, y0), (x1, y1), (400 * n, 2))
        xy = inside[arena.zone_of(inside) > 0][:n]
        positions = np.empty((n_samples, n, 2))
        for step in range(n_samples):
            wanted = xy + rng.normal(0, 0.02, xy.shape)
            xy = np.where((arena.zone_of(wanted) > 0)[:, None], wanted, xy)
            positions[step] = xy
        kind = np.zeros(n, dtype=np.int8)
        kind[-1] = robot
        return Samples(
            dt_s=DT_S,
            k=np.arange(first_k, first_k + n_samples),
            agent=np.arange(n, dtype=np.int32),
            kind=kind,
            xy_m=positions,
            confidence=np.ones((n_samples, n), dtype=np.float32),
        )

    return make


@pytest.fixture(scope="session")
def course():
    """Return what makes a score over time from its values; 120, 180, ... s."""

    def make(values, *, ceiling=None, half_width=0.1, n=200, first_s=120):
        value = np.asarray(values, dtype=float)
        mean = np.full(len(value), np.nan if ceiling is None else ceiling)
        return Course(
            end_s=first_s + 60 * np.arange(len(value)),
            value=value,
            low=mean - half_width,
            high=mean + half_width,
            ceiling=mean,
            n=np.full(len(value), 0 if ceiling is None else n),
        )

    return make


@pytest.fixture(scope="session")
def rounds_of():
    """Return what makes calibrated rounds with intervals; every third parameter unidentified."""

    def make(arena, n_rounds):
        model = natural(tuple((z.name, z.follows_walls) for z in arena.zones), dt_s=DT_S)
        names = gene_names(arena.zone_names)
        start = Round(second=0, parameters=model)
        made = [
            Round(
                second=120 + 60 * number,
                parameters=model,
                intervals=dict.fromkeys(names, (0.1, 0.9)),
                unidentified=frozenset(names[::3]),
                hypervolume=(0.2, 0.3, 0.4 + 0.01 * number),
            )
            for number in range(n_rounds)
        ]
        return [start, *made]

    return make


@pytest.fixture(scope="session")
def make_view(two_rooms, course, rounds_of, wander):
    """Return what makes all that is known of a trial; keywords replace parts of it."""
    samples = wander(two_rooms)
    seen = see([locate(samples, two_rooms)])
    fish = measure(samples.of_kind(0), two_rooms)
    robot = measure_robot(samples, two_rooms)

    def make(name="trial", *, n_windows=8, **changes):
        courses = {}
        for number, feature in enumerate(FEATURE_NAMES):
            for zone in (None, *(two_rooms.zone_names if feature in "DWT" else ())):
                values = np.linspace(0.7, 0.8, n_windows) + 0.01 * number
                courses[MODEL, feature, zone] = course(values, ceiling=0.85)
                courses[SOCIAL, feature, zone] = course(values + 0.1)
                courses[ROBOT, feature, zone] = course(values - 0.1, ceiling=0.9, n=4)
        view = TrialView(
            root=Path(name),
            trial=Trial(
                root=Path(name), arena="two-rooms", n_fish=4, n_robots=1, fps=FPS, dt_s=DT_S, seed=1
            ),
            arena=two_rooms,
            courses=courses,
            statistics={(540, "control"): fish, (540, "robot"): robot},
            rounds=rounds_of(two_rooms, n_windows),
            model_statistics=fish + robot,
            model_visits=seen.visits[FISH],
            seen=seen,
            integration=Integration(
                start_s=300,
                end_s=540,
                robot={
                    feature: Mark(value=0.6, low=0.8, high=0.95, ceiling=0.9, n=4)
                    for feature in FEATURE_NAMES
                },
                halves=dict.fromkeys(FEATURE_NAMES, 0.9),
            ),
            sources=(),
            following=followed_from(_followed_rows(540), start_s=300),
        )
        return replace(view, **changes)

    return make


@pytest.fixture(scope="session")
def write_small_trial(wander, two_rooms):
    """Return what writes a trial with tracks and, when asked for, statistics, scores and models."""

    def make(root, *, minutes=4, n_robots=1, analysed=True, calibrated=True):
        trial = Trial(
            root=root,
            arena="two-rooms",
            n_fish=5 - n_robots,
            n_robots=n_robots,
            fps=FPS,
            dt_s=DT_S,
            seed=1,
        )
        write_trial(trial)
        _write_tracks(trial, wander(two_rooms, n_samples=300 * minutes, robot=n_robots > 0))
        for end_s in range(120, 60 * minutes + 1, 60):
            if analysed:
                _write_window(trial, two_rooms, wander, end_s)
            if calibrated:
                _write_round(trial, two_rooms, end_s)
        return root

    return make


@pytest.fixture
def small_trial(tmp_path, write_small_trial):
    """Return what writes a trial of a name into the test's own folder."""
    return lambda name="trial", **parts: write_small_trial(tmp_path / name, **parts)


@pytest.fixture(scope="session")
def drawn_trial(tmp_path_factory, write_small_trial, stub_model, stub_visits):
    """A trial with its report, drawn once for all tests: look at it, or copy it."""
    root = write_small_trial(tmp_path_factory.mktemp("drawn") / "trial")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("zfcal.report.simulated.long_run", stub_model)
        patch.setattr("zfcal.report.simulated.long_visits", stub_visits)
        write_report([root])
    return root


def _followed_rows(end_s):
    numbers = {"value": 0.3, "low": 0.1, "high": 0.5, "ceiling": 0.4, "floor": 0.2, "n": 9}
    names = [("direction", lag_s) for lag_s in (-0.2, 0.0, 0.2)]
    names += [(name, None) for name in ("following", "lead", "delay")]
    names += [(name, None) for name in ("departures_led", "departures_followed")]
    return [
        {"window_end_s": end_s, "measure": name, "lag_s": lag_s, **numbers} for name, lag_s in names
    ]


def _lineage(schema, command):
    return Lineage(schema=f"zfcal.{schema}/1", command=command, options={"dt_s": DT_S}, seed=1)


def _write_tracks(trial, samples):
    n_steps, n = samples.xy_m.shape[:2]
    for start in range(0, n_steps, 300):
        k = np.repeat(np.arange(start, min(start + 300, n_steps)), n)
        agent = np.tile(np.arange(n), len(k) // n)
        tracks = Tracks(
            time_s=k * DT_S,
            frame=k * 3,
            agent=agent.astype(np.int32),
            kind=samples.kind[agent],
            x_m=samples.xy_m[k, agent, 0],
            y_m=samples.xy_m[k, agent, 1],
            heading_rad=np.zeros(len(k), dtype=np.float32),
            confidence=np.ones(len(k), dtype=np.float32),
        )
        path = trial.path("tracks", start // 5, ".parquet")
        write_tracks(path, tracks, _lineage("tracks", "import"))


def _write_window(trial, arena, wander, end_s):
    samples = wander(arena, robot=trial.n_robots > 0, seed=end_s)
    cases = {"control": measure(samples.of_kind(0), arena)}
    if trial.n_robots:
        cases["robot"] = measure_robot(samples, arena)
    rows = [
        statistics_to_rows(counts, window_end_s=end_s, case=case) for case, counts in cases.items()
    ]
    joined = {key: [value for part in rows for value in part[key]] for key in rows[0]}
    write_table(
        trial.path("stats", end_s, ".parquet"),
        make_table("zfcal.stats/1", joined),
        _lineage("stats", "analyse"),
    )
    compared = ["social-vs-control", "robot-vs-fish"] if trial.n_robots else []
    _write_scores(trial, compared, end_s, ending=".parquet")


def _write_scores(trial, compared, end_s, *, ending):
    keys = [(c, f) for c in compared for f in FEATURE_NAMES]
    n = len(keys)
    columns = {
        "window_end_s": [end_s] * n,
        "compared": [c for c, _ in keys],
        "feature": [f for _, f in keys],
        "zone": [None] * n,
        "value": [0.7] * n,
        "low": [None if c == "social-vs-control" else 0.75 for c, _ in keys],
        "high": [None if c == "social-vs-control" else 0.95 for c, _ in keys],
        "ceiling": [None if c == "social-vs-control" else 0.85 for c, _ in keys],
        "n_windows": [None if c == "social-vs-control" else 4 for c, _ in keys],
        "n_features": [4 if f == "S" else None for _, f in keys],
    }
    write_table(
        trial.path("scores", end_s, ending),
        make_table("zfcal.scores/1", columns),
        _lineage("scores", "analyse"),
        extra={"robot_pooled_from_s": max(0, end_s - 120)},
    )


def _write_round(trial, arena, end_s):
    model = natural(tuple((z.name, z.follows_walls) for z in arena.zones), dt_s=DT_S)
    row = {"value": 0.5, "low": 0.1, "high": 0.9, "identified": True}
    parameters = {name: dict(row) for name in gene_names(arena.zone_names)}
    parameters["walls.alpha"]["identified"] = False
    result = {
        "S": 0.7,
        "hypervolume": [0.2, 0.4],
        "intervals": {"parameters": parameters},
    }
    path = trial.path("models", end_s, ".toml")
    write_model(path, model, _lineage("model", "calibrate"), result)
    _write_scores(trial, ["model-vs-control"], end_s, ending="-model.parquet")


@pytest.fixture(scope="session")
def stub_model(two_rooms, wander):
    """Return wandering agents for any model: the long simulation compiles for long."""
    statistics = measure(wander(two_rooms, seed=9), two_rooms)
    return lambda *_, **__: statistics


@pytest.fixture(scope="session")
def stub_visits(two_rooms, wander):
    """Return where agents wander for any model."""
    visits = visits_of(locate(wander(two_rooms, seed=9, robot=False), two_rooms))
    return lambda *_, **__: visits


@pytest.fixture
def quick_model(monkeypatch, stub_model, stub_visits):
    """Put wandering agents in the place of the long simulation."""
    monkeypatch.setattr("zfcal.report.simulated.long_run", stub_model)
    monkeypatch.setattr("zfcal.report.simulated.long_visits", stub_visits)


@pytest.fixture
def quick_pictures(monkeypatch):
    """Draw nothing: for tests of what is written when, and of words."""
    monkeypatch.setattr(
        "zfcal.report.page.write_printed",
        lambda picture, kind, path, _: path.write_text(f"{picture.title}, {kind}", "utf-8"),
    )
    monkeypatch.setattr("zfcal.report.render.panel_svg", lambda *_: "<svg></svg>")


@pytest.fixture(scope="session")
def covered_texts():
    """Return what finds texts of a picture, at a width on paper, that cover each other."""

    def find(picture, width_mm=None):
        with theme.style(on_paper=width_mm is not None):
            figure = compose(picture, width_in=None if width_mm is None else width_mm / 25.4)
            theme.lay_out(figure)
            figure.canvas.draw()
            renderer = figure.canvas.get_renderer()
            undrawn = {label for axes in figure.findobj(Axes) for label in _undrawn(axes)}
            boxes = [
                (text.get_text(), text.get_window_extent(renderer))
                for text in dict.fromkeys(figure.findobj(Text))
                if text.get_visible() and text.get_text().strip() and text not in undrawn
            ]
        width, height = figure.bbox.width, figure.bbox.height
        outside = [
            (name,)
            for name, box in boxes
            if box.x0 < -1 or box.y0 < -1 or box.x1 > width + 1 or box.y1 > height + 1
        ]
        pairs = itertools.combinations(boxes, 2)
        # Boxes hold room above and below the letters: a touch is no overlap.
        return outside + [(a, b) for (a, p), (b, q) in pairs if p.padded(-1.5).overlaps(q)]

    return find


def _undrawn(axes):
    """Return the tick labels beyond the ends of the axes, which are there but not drawn."""
    undrawn = set()
    for axis in (axes.xaxis, axes.yaxis):
        drawn = axis._update_ticks()
        ticks = {*axis.get_major_ticks(), *axis.get_minor_ticks(), *drawn}
        undrawn |= {label for tick in ticks for label in (tick.label1, tick.label2)}
        undrawn -= {tick.label1 for tick in drawn}
    return undrawn
