"""docs/architecture.md says how to add a statistic: it is done here, to the letter."""

import importlib
import re
import subprocess
import sys
import tomllib

import numpy as np
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.tables import read_table, read_tracks
from zfcal.behaviour.features.registry import further, named, statistics
from zfcal.behaviour.rows import statistics_from_rows
from zfcal.report.figures.panels import compose
from zfcal.report.figures.statistics import statistics_picture
from zfcal.sampling import sample
from zfcal.stages.analyse.analyse import AnalyseOptions, analyse
from zfcal.stages.events import Made, UpToDate
from zfcal.stages.trial_context import open_trial


@pytest.fixture
def package(repository, tmp_path, monkeypatch):
    """Install the page's example, and return where."""
    page = (repository / "docs" / "architecture.md").read_text(encoding="utf-8")
    section = page.partition("## Add a statistic")[2].partition("\n## ")[0]
    (code,) = re.findall(r"^```python\n(.*?)^```", section, re.DOTALL | re.MULTILINE)
    (project,) = re.findall(r"^```toml\n(.*?)^```", section, re.DOTALL | re.MULTILINE)
    points = tomllib.loads(project)["project"]["entry-points"]
    place = tmp_path / "site"
    about = place / "lab_statistics-1.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: lab-statistics\nVersion: 1\n")
    (about / "entry_points.txt").write_text(
        "".join(
            f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in names.items())
            for group, names in points.items()
        )
    )
    (place / "lab_statistics.py").write_text(code, encoding="utf-8")
    monkeypatch.syspath_prepend(str(place))
    importlib.invalidate_caches()
    statistics.cache_clear()
    yield place
    sys.modules.pop("lab_statistics", None)
    statistics.cache_clear()


def read(root, end):
    """Return the statistics of a window by case."""
    table = read_table(root / "stats" / f"{end:06d}.parquet", "zfcal.stats/1").to_pydict()
    return {case: found for (_, case), found in statistics_from_rows(table).items()}


def directions(root, end):
    """Return the fish's steps by zone and tenth of a turn, in the plainest way."""
    opened = open_trial(root)
    zones, (start, mid) = opened.arena.zones, (end - 120, end - 60)
    parts = [read_tracks(root / "tracks" / f"{second:06d}.parquet") for second in (start, mid)]
    seen = {}
    for part, second in zip(parts, (start, mid), strict=True):
        trial = opened.trial
        cut = sample(part, fps=trial.fps, dt_s=trial.dt_s, start_s=second, end_s=second + 60)
        for row, column in np.argwhere(~np.isnan(cut.xy_m[..., 0])):
            if cut.kind[column] == 0:
                seen[int(cut.agent[column]), int(cut.k[row])] = cut.xy_m[row, column]
    counts = np.zeros((len(zones), 10), dtype=int)
    for (agent, k), xy_m in seen.items():
        after = seen.get((agent, k + 1))
        ids = opened.arena.zone_of(np.array([xy_m, xy_m if after is None else after]))
        if after is not None and ids.all():
            turn = np.arctan2(*(after - xy_m)[::-1]) / (2 * np.pi) + 0.5
            counts[ids[0] - 1, min(int(turn * 10), 9)] += 1
    return counts


@pytest.mark.usefixtures("package")
def test_it_is_computed_compared_and_drawn(make_trial, heard):
    """Counts are those of the plainest way; a panel for each zone says how alike two cases are."""
    root = make_trial(seconds=120, n_robots=1)
    options = AnalyseOptions(features=("direction",))
    analyse(root, options, heard.append)

    cases = read(root, 120)
    assert further(options.features) == ("direction",)
    assert np.array_equal(cases["control"].of("direction"), directions(root, 120))
    assert cases["robot"].of("direction").sum() == cases["robot"].speed.sum()

    arena = open_trial(root).arena
    shown = {"fish": cases["control"], "model": cases["social"], "robot": cases["robot"]}
    figure = compose(statistics_picture(shown, arena, title="x"))
    for row, zone in enumerate(arena.zone_names):
        (axes,) = (
            a for a in figure.axes if a.get_title(loc="left") == f"Direction of a step, {zone}"
        )
        alike = named("direction").compare(
            *(shown[c].of("direction")[row] for c in list(shown)[:2])
        )
        assert [text.get_text() for text in axes.texts] == [
            f"similarity {float(alike):.2f}\nn = {shown['fish'].of('direction')[row].sum()}"
        ]
        assert axes.get_xlabel() == "direction (rad)"


def test_the_command_counts_it(package, make_trial):
    """In a process of its own, which finds the package by its entry point alone."""
    root = make_trial(seconds=120)
    done = subprocess.run(
        [sys.executable, "-m", "zfcal_cli.main", "analyse", str(root), "--features", "direction"],
        env={"PYTHONPATH": str(package), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert read(root, 120)["control"].of("direction").sum() > 0
    assert read_lineage(root / "stats" / "000120.parquet").options["features"] == ["direction"]


def test_a_file_with_it_is_read_where_its_package_is_not(package, make_trial, heard):
    """The counts are there; what nobody here knows how to draw is not drawn."""
    root = make_trial(seconds=120)
    analyse(root, AnalyseOptions(features=("direction",)), heard.append)
    sys.path.remove(str(package))
    importlib.invalidate_caches()
    statistics.cache_clear()

    control = read(root, 120)["control"]

    assert control.names == ("D", "W", "O", "T", "V", "direction")
    picture = statistics_picture({"fish": control}, open_trial(root).arena, title="x")
    assert not [panel for panel in picture.panels if "Direction" in panel.title]


@pytest.mark.usefixtures("package")
def test_files_without_it_stay_up_to_date(make_trial, heard):
    """A trial that was analysed without naming it has nothing to do, whatever is installed."""
    root = make_trial(seconds=120)
    analyse(root, AnalyseOptions(), heard.append)
    assert "features" not in read_lineage(root / "stats" / "000120.parquet").options
    heard.clear()

    analyse(root, AnalyseOptions(), heard.append)
    assert not [event for event in heard if isinstance(event, Made)]
    assert [event for event in heard if isinstance(event, UpToDate)]

    analyse(root, AnalyseOptions(features=("direction",)), heard.append)
    made = [event.path.parent.name for event in heard if isinstance(event, Made)]
    assert made == ["stats"]


@pytest.mark.usefixtures("package")
def test_a_control_of_other_trials_is_counted_window_by_window(make_trial, heard):
    """Four minutes are two windows: what the control holds is what their fish did in each."""
    alone, root = make_trial("alone", seconds=240), make_trial(seconds=120, n_robots=1)
    analyse(root, AnalyseOptions(features=("direction",), control=(alone,)), heard.append)

    expected = directions(alone, 120) + directions(alone, 240)
    assert np.array_equal(read(root, 120)["control"].of("direction"), expected)
