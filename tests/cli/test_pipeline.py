"""Commands joined by pipes, as people and cron join them."""

import subprocess
import sys
import threading

import pytest

from zfcal.model.kernels.compiled import cache_folder

ROUND = "--generations 1 --population 4 --steps 20 --seed 1 --no-seed-likelihood"


@pytest.fixture
def shell(tmp_path, command):
    """Run a line of shell, with zfcal as a function of it."""

    def call(line, **options):
        words = " ".join(f"'{word}'" for word in command)
        return subprocess.run(
            ["bash", "-c", f'zfcal() {{ {words} "$@"; }}\n{line}'],
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
            **options,
        )

    return call


@pytest.fixture
def artifacts():
    """Return what reads every artifact of a trial, by its name."""

    def read(root):
        return {
            path.relative_to(root).as_posix(): path.read_bytes()
            for path in root.rglob("*")
            if path.is_file() and not path.name.startswith(".")
        }

    return read


INIT = "--side-m 1 --fish 3 --robot --fps 5 --seed 1 -q >/dev/null"


@pytest.mark.slow
def test_a_pipeline_ends_in_the_bytes_of_one_command_after_the_other(
    shell, zfcal, tracks_csv, artifacts, tmp_path
):
    """Import | analyse - | calibrate -, and its last command names all that it made."""
    tracks_csv()
    piped = shell(
        f"set -o pipefail; zfcal init a {INIT}; zfcal import tracks.csv a --format csv "
        f"| zfcal analyse - | zfcal calibrate - {ROUND}"
    )
    assert piped.returncode == 0, piped.stderr
    assert piped.stdout.split() == [
        f"a/{name}"
        for end in ("000120", "000180")
        for name in (
            f"models/{end}.parquet",
            f"scores/{end}-model.parquet",
            f"scores/{end}-rules.parquet",
            f"models/{end}.toml",
        )
    ]
    for line in (
        f"init b {INIT.partition(' >')[0]}",
        "import tracks.csv b --format csv",
        "analyse b",
        f"calibrate b {ROUND}",
    ):
        single = zfcal(*line.split())
        assert single.code == 0, single.err
    assert artifacts(tmp_path / "a") == artifacts(tmp_path / "b")


def test_a_pipe_is_worked_on_line_by_line(command, trial):
    """The first window is there while the pipe is open, the second when it has closed."""
    with subprocess.Popen(
        [*command, "analyse", "-"],
        cwd=trial.parent,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        bufsize=1,
    ) as analyse:
        guard = threading.Timer(60, analyse.kill)
        guard.start()
        analyse.stdin.write("trial/tracks/000000.parquet\n")
        analyse.stdin.flush()
        assert analyse.stdout.readline() == "trial/stats/000120.parquet\n"
        assert analyse.stdout.readline() == "trial/stats/000120-following.parquet\n"
        assert analyse.stdout.readline() == "trial/scores/000120.parquet\n"
        assert analyse.poll() is None
        analyse.stdin.close()
        rest = analyse.stdout.read().split()
        guard.cancel()
        assert analyse.wait() == 0
    # The lines were hints; what they did not name is found at the end.
    names = ("stats/000180", "stats/000180-following", "scores/000180")
    assert rest == [f"trial/{name}.parquet" for name in names]


@pytest.mark.parametrize(("line", "begins"), [
    ("\0" * 100_000, r"'\x00\x00"),
    ("trial\0", r"'trial\x00'"),
    ("a/" * 3000, "'a/a/"),
])  # fmt: skip
def test_a_line_that_is_no_path_is_shown_in_short(zfcal, monkeypatch, line, begins):
    """Something else was piped in: a line of it is no message."""
    monkeypatch.setattr(sys, "stdin", iter([f"{line}\n"]))
    done = zfcal("analyse", "-")
    assert done.code == 1
    says = f"zfcal: error: standard input: a line of {len(line)} characters that begins with "
    assert done.err.startswith(f"{says}{begins}")
    assert max(map(len, done.err.splitlines())) < 200
    assert "\0" not in done.err


@pytest.mark.slow
def test_an_upstream_that_fails_is_seen_by_pipefail_and_does_no_harm(shell, trial):
    """Nothing comes through the pipe: that is said, and is nothing to do."""
    done = shell("set -o pipefail; zfcal import nowhere.csv trial | zfcal analyse -")
    assert done.returncode == 2
    assert "No artifact came on standard input: nothing to do." in done.stderr
    alone = shell("zfcal analyse - </dev/null")
    assert (alone.returncode, alone.stdout) == (0, "")


def test_a_line_that_is_no_artifact_is_named_and_the_others_go_on(shell, trial):
    """Exit code 1, with the good ones done."""
    done = shell(r"printf 'nonsense/x\n\ntrial/tracks/000060.parquet\n' | zfcal analyse -")
    assert done.returncode == 1
    assert "nonsense/x: is not in a trial" in done.stderr
    assert "trial/stats/000120.parquet" in done.stdout


@pytest.mark.slow
def test_damage_upstream_comes_through_as_exit_code_3(shell, trial):
    """Of the windows that can be made, models are made."""
    path = trial / "tracks" / "000120.parquet"
    path.write_bytes(path.read_bytes()[:1000])
    done = shell(f"zfcal analyse trial | zfcal calibrate - {ROUND}; echo ${{PIPESTATUS[@]}}")
    assert done.stdout.split()[-2:] == ["3", "0"]
    assert "trial/models/000120.toml" in done.stdout


@pytest.mark.slow
def test_several_trials_go_through_one_pipe(shell, tracks_csv, tmp_path):
    """Each path says which trial it belongs to."""
    tracks_csv()
    tracks_csv("second.csv", seed=2)
    done = shell(
        f"zfcal init a {INIT}; zfcal init b {INIT}; "
        "{ zfcal import tracks.csv a; zfcal import second.csv b; } | zfcal analyse -"
    )
    assert done.returncode == 0, done.stderr
    assert {line.split("/")[0] for line in done.stdout.split()} == {"a", "b"}
    assert len(done.stdout.split()) == 12


@pytest.mark.slow
def test_a_line_of_cron_works(trial, tmp_path):
    """No terminal, an empty home, an almost empty environment, an absolute path.

    Its kernels are those that are compiled already: what a first start does is tested elsewhere.
    """
    zfcal = f"{sys.executable} -m zfcal_cli.main"
    line = f"{zfcal} analyse {trial} && {zfcal} calibrate {trial} {ROUND}"
    home = tmp_path / "home"
    home.mkdir()
    done = subprocess.run(
        ["/bin/sh", "-c", line],
        cwd="/",
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        env={
            "PATH": "/usr/bin:/bin",
            "HOME": str(home),
            "LOGNAME": "cron",
            "XDG_CACHE_HOME": str(cache_folder().parents[1]),
        },
    )
    assert done.returncode == 0, done.stderr
    assert f"{trial}/models/000180.toml" in done.stdout
    assert "\x1b" not in done.stderr


def test_paths_are_those_that_were_given(shell, trial):
    """Relative stays relative, absolute stays absolute."""
    relative = shell("zfcal analyse trial")
    absolute = shell(f"zfcal analyse {trial}")
    assert relative.stdout.split()[0] == "trial/stats/000120.parquet"
    assert absolute.stdout.split()[0] == f"{trial}/stats/000120.parquet"
