"""What a shell has run by `serving.py` is as if it had been started."""

import os
import shlex
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow


@pytest.fixture
def shell(brief_zfcal, tmp_path):
    """Return what runs a line of a shell in an empty folder."""

    def run(line):
        text = f'zfcal() {{ {shlex.join(brief_zfcal)} "$@"; }}; {line}'
        return subprocess.run(
            ["bash", "-c", text],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )

    return run


def test_words_folder_streams_and_exit_codes_are_those_of_the_shell(shell, tmp_path):
    """Of a word that is wrong, of none, and of a trial that is made in the folder."""
    wrong = shell("zfcal analyze")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert "No command 'analyze'" in wrong.stderr
    assert "Usage: zfcal" in shell("zfcal").stderr
    made = shell("zfcal init trial --side-m 1 --fish 2 --fps 5")
    assert (made.returncode, made.stdout.splitlines()[0]) == (0, "trial/models/000000.toml")
    assert (tmp_path / "trial" / "trial.toml").is_file()


def test_commands_read_what_comes_through_a_pipe(shell):
    """And the next one reads what they write."""
    shell("zfcal init trial --side-m 1 --fish 2 --fps 5")
    found = shell("echo trial/tracks/000060.parquet | zfcal analyse - 2>&1 | tee said | wc -l")
    assert int(found.stdout) > 0
    assert "trial/tracks: 0 whole segments" in shell("cat said").stdout


def test_a_command_whose_caller_is_killed_ends(shell, brief_zfcal, tmp_path):
    """Nobody else has its output open: it would be read for ever."""
    shell("zfcal init trial --side-m 1 --fish 2 --fps 5")
    line = [*brief_zfcal, "watch", "trial", "-v"]
    with subprocess.Popen(line, cwd=tmp_path, stderr=subprocess.PIPE) as caller:
        assert os.read(caller.stderr.fileno(), 1)
        caller.kill()
        caller.communicate(timeout=60)


def test_processes_with_the_brief_environment_are_brief(briefly, repository):
    """Whoever starts them: the site reads it."""
    program = "from zfcal.calibrate.task import Settings; print(Settings().n_confirmed)"
    line = [sys.executable, "-c", program]
    usual, brief = (
        subprocess.run(line, env=env, cwd=repository, capture_output=True, text=True, check=True)
        for env in (None, briefly)
    )
    assert int(brief.stdout) < int(usual.stdout)
