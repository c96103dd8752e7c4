"""Each command once on a small trial, and what it says when something is wrong."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from zfcal import readers
from zfcal.artifacts.lock import lock
from zfcal.writers import FORMATS as EXPORTED
from zfcal.writers import TABLES
from zfcal_cli.export import FORMATS as EXPORTS
from zfcal_cli.foreign import FORMATS, import_options

EXPORT_FILES = ("trajectories.npy", "export-idtracker.json")
ROUND = ("--generations", "1", "--population", "4", "--steps", "20", "--no-seed-likelihood")


def test_init_makes_a_trial_and_says_where(zfcal):
    """Two files, one a line; the second time there is nothing to do."""
    words = ("init", "trial", "--arena", "two-rooms", "--fish", "4", "--robot", "--fps", "15")
    done = zfcal(*words)
    assert done.code == 0
    assert done.lines == ["trial/models/000000.toml", "trial/trial.toml"]
    again = zfcal(*words)
    assert again.lines == done.lines
    assert "nothing to do" in again.err


def test_init_refuses_a_trial_that_differs(zfcal):
    """With exit code 1 and what to do."""
    zfcal("init", "trial", "--arena", "ring", "--fish", "6")
    done = zfcal("init", "trial", "--arena", "ring", "--fish", "5")
    assert done.code == 1
    assert "n_fish = 6, the command gives 5" in done.err
    assert "--force" in done.err
    assert zfcal("init", "trial", "--arena", "ring", "--fish", "5", "--force").code == 0


def test_import_takes_options_in_the_units_of_people(zfcal):
    """Millimetres become metres; what is not given is not passed on."""
    given = {"fps": None, "mm_per_px": 0.5, "noise_mm": 2.0, "flip_y": False, "origin": (0.0, 9.0)}
    assert import_options(given) == {"m_per_px": 0.0005, "noise_m": 0.002, "origin": (0.0, 9.0)}
    assert import_options({"robots": (), "first_frame": 0}) == {"robots": (), "first_frame": 0}


def test_the_formats_are_those_of_the_library():
    """Written out in the command, which must not load the library for its help."""
    assert set(FORMATS) == set(readers.FORMATS)


def test_the_formats_of_the_export_are_those_of_the_library():
    """Written out in the command as well; all that tracks are exported in is imported."""
    assert (*TABLES, *EXPORTED) == EXPORTS
    assert set(EXPORTED) <= set(readers.FORMATS)


def test_an_export_is_read_back_by_the_command_that_it_tells(zfcal, trial):
    """The line on standard error, with a trial's name, imports the same tracks again."""
    done = zfcal("export", "trial", "--to", "idtracker")
    assert done.code == 0
    assert done.lines == [f"trial/export/idtracker/{name}" for name in EXPORT_FILES]
    (line,) = [line for line in done.err.splitlines() if "read back with" in line]
    words = line.partition("zfcal import ")[2].replace("TRIAL", "again").split()
    zfcal("init", "again", "--side-m", "1", "--fish", "3", "--robot", "--fps", "5")
    assert zfcal("import", *words).code == 0
    rows = []
    for name in ("trial", "again"):
        (seen,) = json.loads(zfcal("inspect", f"{name}/tracks/000060.parquet", "--json").out)[
            "results"
        ]
        rows.append(seen["contents"]["head"])
    for one, two in zip(*rows, strict=True):
        assert (one["agent"], one["kind"]) == (two["agent"], two["kind"])
        assert (one["x_m"], one["y_m"]) == pytest.approx((two["x_m"], two["y_m"]), abs=1e-9)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("trial",), "There is nothing to export"),
        (("trial", "--to", "csv", "--mm-per-px", "1"), "have no effect"),
        (("trial", "--layout", "--origin", "1,2"), "have no effect"),
        (("trial", "--to", "ctrax"), "'ctrax' is not one of"),
        (("trial", "trial-2", "--to", "sleap", "-o", "out"), "there are several"),
    ],
)
def test_an_export_that_cannot_take_effect_is_wrong_usage(zfcal, trial, words, says):
    """Told before anything is read."""
    zfcal("init", "trial-2", "--side-m", "1", "--fish", "3", "--fps", "5")
    done = zfcal("export", *words)
    assert done.code == 2
    assert says in done.err


@pytest.mark.parametrize(
    ("option", "text"),
    [("--origin", "5"), ("--origin", "a,b"), ("--columns", "x_m"), ("--body-axis", "head")],
)
def test_import_options_of_another_form_are_wrong_usage(zfcal, trial, option, text):
    """Pairs and lists are checked before anything is read."""
    assert zfcal("import", "tracks.csv", "trial", option, text).code == 2


def test_pixels_are_imported_with_a_scale_and_y_up(zfcal, tmp_path):
    """(500, 200) px at 1 mm a pixel, from a lower left corner at (0, 1000), is (0.5, 0.8) m."""
    zfcal("init", "trial", "--side-m", "1", "--fish", "1", "--fps", "5")
    (tmp_path / "px.csv").write_text("time_s,agent,x_px,y_px\n0,0,500,200\n0.2,0,500,200\n")
    refused = zfcal("import", "px.csv", "trial")
    assert refused.code == 1
    assert "--mm-per-px" in refused.err
    scale = ("--mm-per-px", "1", "--origin", "0,1000", "--flip-y")
    assert zfcal("import", "px.csv", "trial", *scale).code == 0
    (seen,) = json.loads(zfcal("inspect", "trial/tracks/000000.parquet", "--json").out)["results"]
    head = seen["contents"]["head"][0]
    assert (head["x_m"], head["y_m"]) == pytest.approx((0.5, 0.8))


def test_analyse_makes_statistics_and_scores(zfcal, trial):
    """200 s have two windows; a dry run says so before, JSON after."""
    planned = zfcal("analyse", "trial", "--dry-run")
    assert planned.out == ""
    assert "would make trial/stats/000120.parquet: missing" in planned.err
    done = zfcal("analyse", "trial")
    assert done.code == 0
    assert done.lines == [
        f"trial/{name}.parquet"
        for end in ("000120", "000180")
        for name in (f"stats/{end}", f"stats/{end}-following", f"scores/{end}")
    ]
    document = json.loads(zfcal("analyse", "trial", "--json").out)
    assert [a["path"] for a in document["artifacts"]] == done.lines
    assert {a["state"] for a in document["artifacts"]} == {"up to date"}


def test_calibrate_makes_models(zfcal, trial):
    """Four files a window; the result of each round is in the JSON document."""
    zfcal("analyse", "trial")
    document = json.loads(zfcal("calibrate", "trial", *ROUND, "--json").out)
    assert [a["path"] for a in document["artifacts"]][:4] == [
        "trial/models/000120.parquet",
        "trial/scores/000120-model.parquet",
        "trial/scores/000120-rules.parquet",
        "trial/models/000120.toml",
    ]
    assert [result["window_end_s"] for result in document["results"]] == [120, 180]
    assert all(0 <= result["S"] <= 1 and result["ceiling"] for result in document["results"])
    assert "nothing to do, 8 up to date" in zfcal("calibrate", "trial", *ROUND).err


def test_calibrate_a_stretch_into_a_file_of_its_own(zfcal, trial):
    """With its score on what was held out."""
    words = ("--window", "0:120", "--held-out", "120:200", "-o", "half.toml")
    done = zfcal("calibrate", "trial", *ROUND, *words)
    assert (done.code, done.lines) == (0, ["half.toml"])
    (seen,) = json.loads(zfcal("inspect", "half.toml", "--json").out)["results"]
    assert set(seen["contents"]["result"]["held_out"]) == {"window", "before", "after"}


def test_simulate_a_model_into_a_new_trial(zfcal, trial):
    """With the arena and the agents of the trial in which the model lies."""
    words = ("simulate", "other", "--model", "trial/models/000000.toml", "--duration", "2min")
    done = zfcal(*words, "--seed", "2")
    assert done.code == 0
    assert done.lines[-2:] == ["other/tracks/000000.parquet", "other/tracks/000060.parquet"]
    assert zfcal("analyse", "other").code == 0


@pytest.mark.slow
def test_a_trial_is_imported_analysed_and_calibrated_without_pandas(tracks_csv, tmp_path):
    """It would take a third of the time of a short round; the second round reads the first."""
    tracks_csv()
    beside = ("init", "trial", "--side-m", "1", "--fish", "3", "--robot", "--fps", "5")
    commands = (
        beside,
        ("import", "tracks.csv", "trial", "--format", "csv"),
        ("analyse", "trial"),
        ("calibrate", "trial", *ROUND),
    )
    script = (
        "import sys\n"
        "from zfcal_cli.main import run\n"
        f"for words in {commands!r}:\n"
        "    assert run([*words, '-q']) == 0\n"
        "sys.exit('pandas' in sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "trial" / "models" / "000180.toml").exists()


@pytest.mark.slow
def test_report_writes_a_page_once(zfcal, trial):
    """The second time there is nothing to do."""
    zfcal("analyse", "trial")
    planned = zfcal("report", "trial", "--dry-run").err.splitlines()
    done = zfcal("report", "trial")
    assert done.code == 0
    assert planned[:-1] == [f"would make {line}: missing" for line in done.lines]
    assert done.lines[0] == "trial/report/index.html"
    assert "nothing to do" in zfcal("report", "trial").err
    assert (
        "would make trial/report/index.html: forced"
        in zfcal("report", "trial", "-n", "--force").err
    )


@pytest.mark.slow
def test_a_report_over_several_trials_lies_beside_them(zfcal, trial):
    """Where the command was called; each has its own page as well, to which a table leads."""
    zfcal("analyse", "trial")
    zfcal("init", "other", "--side-m", "1", "--fish", "3", "--robot", "--fps", "5")
    done = zfcal("report", "trial", "other")
    assert done.code == 0, done.err
    assert "report/index.html" in done.lines
    assert (trial.parent / "report" / "intervals.csv").exists()
    assert {"trial/report/index.html", "other/report/index.html"} <= {*done.lines}
    page = (trial.parent / "report" / "index.html").read_text()
    links = re.findall(r'<td><a href="([^"#]+)">(\w+)</a>', page)
    assert links == [(f"../{name}/report/index.html", name) for name in ("trial", "other")]
    assert all((trial.parent / "report" / link).is_file() for link, _ in links)
    second = zfcal("report", "trial", "other")
    assert {*second.lines} == {*done.lines}
    assert "nothing to do" in second.err
    assert set(re.findall(r'(?:src|href)="(?!#|data:)([^"]*)"', page)) == {
        link for link, _ in links
    }


@pytest.mark.slow
def test_a_report_over_several_trials_stays_where_it_was_asked_for(zfcal, trial):
    """In the folder of one of them: the page of that trial alone is not written over it."""
    zfcal("analyse", "trial")
    zfcal("init", "other", "--side-m", "1", "--fish", "3", "--robot", "--fps", "5")
    assert zfcal("report", "trial", "other", "-o", "trial/report").code == 0
    page = (trial / "report" / "index.html").read_text()
    assert "other" in page
    assert (trial.parent / "other" / "report" / "index.html").exists()
    assert "nothing to do" in zfcal("report", "trial", "other", "-o", "trial/report").err


@pytest.mark.slow
def test_a_report_names_what_is_damaged_each_time(zfcal, trial):
    """Up to date is not whole: exit 3 of the second run too, until the file is mended."""
    segment = trial / "tracks" / "000060.parquet"
    whole = segment.read_bytes()
    segment.write_bytes(whole[:1000])
    for says in ("0 up to date", "nothing to do"):
        done = zfcal("report", "trial")
        assert done.code == 3
        assert "tracks/000060.parquet: was cut short" in done.err
        assert says in done.err
    document = json.loads(zfcal("report", "trial", "--json").out)
    assert document["exit_code"] == 3
    assert len(document["left_out"]) == 1
    segment.write_bytes(whole)
    assert zfcal("report", "trial").code == 0
    assert zfcal("report", "trial").code == 0


def test_inspect_shows_text_or_json(zfcal, trial):
    """Schema, lineage and contents."""
    text = zfcal("inspect", "trial/tracks/000000.parquet").out
    assert "schema: zfcal.tracks/1" in text
    assert "tracks.csv" in text
    (seen,) = json.loads(zfcal("inspect", "trial/trial.toml", "--json").out)["results"]
    assert seen["contents"]["n_fish"] == 3


def test_inspect_draws_an_arena(zfcal, trial):
    """As a PNG, whose path is told."""
    done = zfcal("inspect", "trial/arena.geojson", "--png", "tank.png")
    assert done.code == 0
    assert done.lines[-1] == "tank.png"
    assert (trial.parent / "tank.png").read_bytes().startswith(b"\x89PNG")
    assert zfcal("inspect", "trial/trial.toml", "--png", "tank.png").code == 2


def test_check_finds_a_trial_sound(zfcal, trial):
    """Everything is whole."""
    done = zfcal("check", "trial")
    assert done.code == 0
    assert "tracks: 4 whole and valid" in done.out


def test_a_file_cut_in_half_is_named_by_all_and_the_rest_goes_on(zfcal, trial):
    """Exit code 3 from inspect, check and analyse; the other window is made."""
    path = trial / "tracks" / "000120.parquet"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    for words in (
        ("inspect", "trial/tracks/000120.parquet"),
        ("check", "trial"),
        ("analyse", "trial"),
    ):
        done = zfcal(*words)
        assert done.code == 3, words
        assert "was cut short" in done.out + done.err
        assert "Traceback" not in done.err
    assert (trial / "stats" / "000120.parquet").exists()
    assert not (trial / "stats" / "000180.parquet").exists()


@pytest.mark.parametrize("name", ["import", "analyse", "calibrate", "report"])
def test_the_second_of_the_same_command_ends_with_75(zfcal, trial, name):
    """And says that it is one; other commands may go on."""
    words = {"import": ("tracks.csv", "trial"), "calibrate": ("trial", *ROUND)}
    zfcal("analyse", "trial")
    with lock(trial, name):
        done = zfcal(name, *words.get(name, ("trial",)))
        assert done.code == 75
        assert f"another zfcal {name} is at work" in done.err
        assert zfcal("check", "trial").code == 0


def test_of_several_trials_one_that_is_wrong_does_not_stop_the_others(zfcal, trial):
    """Exit code 1, and the good one is analysed."""
    done = zfcal("analyse", "nowhere", "trial")
    assert done.code == 1
    assert "nowhere: is not in a trial" in done.err
    assert len(done.lines) == 6


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("n_fish = 3", "n_fihs = 3", "n_fihs"),
        ("fps = 5.0", "fps = nan", "fps"),
        ("fps = 5.0", "fps = 7.0", "dt_s"),
        ('arena = "arena.geojson"', 'arena = "rinng"', "Did you mean 'ring'"),
        ("seed = 0", "seed = ", "trial.toml"),
    ],
)
def test_a_wrong_trial_toml_is_one_line_and_a_hint(zfcal, trial, old, new, says):
    """An unknown key, a rate that is none, a step between frames, an arena nobody has, no TOML."""
    config = trial / "trial.toml"
    text = config.read_text()
    assert old in text
    config.write_text(text.replace(old, new))
    done = zfcal("analyse", "trial")
    assert done.code in {1, 3}
    assert done.err.startswith("zfcal: error: ")
    assert says in done.err
    assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "empty"),
        ("time_s,agent,x_m\n0,0,0.5\n", "y_m"),
        ("time_s,agent,x_m,y_m\n0,0,500,500\n0.2,0,501,500\n", "span x 500.000 to 501.000 m"),
        ("time_s,agent,x_m,y_m\n0,0,inf,0.5\n0.2,0,0.5,0.5\n", "inf"),
        ("time_s,agent,x_m,y_m\n0,0,nan,nan\n0.2,0,nan,nan\n", "missing"),
        ("time_s,agent,x_m,y_m\n0.2,0,0.5,0.5\n0.0,0,0.5,0.5\n", "backwards"),
        ("time_s,agent,x_m,y_m\n0,0,0.5,0.5\n0.1,0,0.5,0.5\n0.2,0,0.5,0.5\n", "Hz"),
    ],
)
def test_a_wrong_csv_is_one_line_and_nothing_is_written(zfcal, trial, text, says):
    """Empty, a column short, millimetres, infinite, all lost, time running backwards, 10 Hz."""
    path = trial.parent / "wrong.csv"
    path.write_text(text)
    before = sorted(trial.rglob("*"))
    done = zfcal("import", "wrong.csv", "trial", "--format", "csv", "--force")
    assert done.code == 1
    assert says in done.err
    assert len(done.err.splitlines()) <= 2
    assert sorted(trial.rglob("*")) == before


@pytest.mark.slow
def test_a_full_disk_is_said_and_loses_nothing(process, trial):
    """A limit on the size of files stands for the full disk: nothing half-written stays."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, hard))
    try:
        done = process("analyse", "trial")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert done.code == 1
    assert "cannot be written" in done.err
    assert "ulimit" in done.err
    assert not list((trial / "stats").iterdir())
    assert process("analyse", "trial").code == 0


@pytest.mark.slow
def test_a_demo_ends_with_figures(zfcal, monkeypatch):
    """A shorter one than people get, tracked from images; its second run does nothing."""
    from zfcal.calibrate.task import Settings

    quick = Settings(
        population=4, generations=1, steps=20, n_confirmed=1, long_runs=1, long_s=20, n_windows=4
    )
    monkeypatch.setattr("zfcal.virtual.demo.DURATION_S", 120.0)
    monkeypatch.setattr("zfcal.virtual.demo.FPS", 5.0)
    monkeypatch.setattr("zfcal.virtual.demo.SETTINGS", quick)
    done = zfcal("demo", "here")
    assert done.code == 0
    assert "Figures: here/trial/report" in done.err
    assert "here/trial/models/000120.toml" in done.lines
    assert "here/trial/poses/000060.mcap" in done.lines
    assert "here/trial/drive/000000.mcap" in done.lines
    looks, runs = done.err.split("What to look at:")[1].split("What to run next:")
    assert "here/trial/report/index.html" in looks
    assert "here/trial/drive/000000.mcap" in looks
    assert "zfcal drive here/trial --replay" in runs
    assert "nothing to do" in zfcal("demo", "here").err
    assert zfcal("drive", "here/trial", "--replay").code == 0
    assert "nothing to do" in zfcal("demo", "here", "--dry-run").err
    Path("here/trial/models/000120.toml").unlink()
    planned = zfcal("demo", "here", "--dry-run").err
    assert "would make here/trial/models/000120.toml: missing" in planned
    assert "would make here/trial/drive/000000.mcap" in planned


def test_a_dry_demo_says_what_files_and_how_long(zfcal):
    """Nothing is written, not even the folder; with the option also for a closed loop."""
    done = zfcal("demo", "here", "--dry-run")
    assert done.code == 0
    assert "would make here/trial/models/000180.toml: missing" in done.err
    assert "about a minute on two cores" in done.err
    loop = zfcal("demo", "here", "--dry-run", "--closed-loop", "--duration", "30min")
    assert "would make here/trial/tracks/001740.parquet: missing" in loop.err
    assert "about 10 min on two cores" in loop.err
    assert not Path("here").exists()
