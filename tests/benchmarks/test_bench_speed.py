"""The benchmarks of speed and growth, each run small; what they compare with is the same law."""

import argparse
import math

import numpy as np
import pytest


@pytest.mark.slow
def test_the_benchmark_of_growth_runs(tiny, tmp_path):
    """Every way of growing has its exponent, and there is a picture."""
    found, _ = tiny("speed/bench_growth.py")
    assert set(found["slopes"]) >= {"duration", "population", "trials", "analysed"}
    assert (tmp_path / "pictures" / "growth.png").stat().st_size > 5000


@pytest.mark.slow
def test_the_benchmark_of_long_trials_runs(tiny):
    """Every command has its row."""
    found, text = tiny("speed/bench_long.py")
    (length,) = found["lengths"]
    assert all(row["now"]["processor_s"] > 0 for row in length["rows"])
    for row in length["rows"]:
        assert f"| {row['command']} | " in text


def test_a_checkout_is_laid_out_or_found_installed(script, repository, tmp_path):
    """Its commands run in either; only the one that is laid out lies in the folder."""
    tree = script("speed.bench_long").Tree
    laid_out, installed = tree.of(repository, tmp_path / "of"), tree.here(tmp_path / "here")
    assert all(each.run("check", "--help")["wall_s"] > 0 for each in (laid_out, installed))
    assert (tmp_path / "of" / "zfcal_cli" / "main.py").exists()
    assert list(installed.path.iterdir()) == []


def test_where_another_checkout_is_installed_this_one_is_laid_out(script, tmp_path, monkeypatch):
    """So that no other program is timed in its name."""
    bench = script("speed.bench_long")
    monkeypatch.setattr(bench, "ROOT", tmp_path / "elsewhere")
    found = bench.Tree.here(tmp_path / "here")
    assert (found.path / "zfcal").readlink() == tmp_path / "elsewhere" / "zfcal"


@pytest.mark.slow
def test_the_roofline_runs(tiny):
    """The bound is below what the kernel takes."""
    found, text = tiny("speed/bench_roofline.py")
    assert 0 < found["ns"]["turn"] < found["ns"]["kernel"]
    assert "the bound is" in " ".join(text.split())


def test_the_exponent_of_a_square_is_two(script):
    """Whatever the factor, and over the larger sizes only."""
    rows = [{"n": n, "cost": 7.0 * n**2 if n > 4 else 1.0} for n in (1, 2, 4, 8, 16, 32)]
    assert script("speed.bench_growth").slope(rows[2:], "n", "cost") == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("asked", "durations"),
    [("", ["30min"]), ("day", ["30min", "24h"]), ("write", ["30min", "24h"]), ("tiny", ["3min"])],
)
def test_committed_lengths_hold_a_day(script, asked, durations):
    """Which is measured otherwise when it is asked for."""
    options = argparse.Namespace(tiny=False, day=False, write=False)
    vars(options).update({asked: True} if asked else {})
    found = script("speed.bench_long").lengths_of(options)
    assert [length.duration for length in found] == durations


def test_the_plain_program_is_the_same_law(script):
    """Published solid angles at 0.05 m, and the mean cosine I1 / I0 at kappa 4, to 1 %."""
    naive = script("shared.naive")
    angles = [naive.solid_angle(0.05, 0.0, math.radians(a)) for a in (0, 45, 90, 180)]
    assert angles == pytest.approx([0.052389, 0.048100, 0.037770, 0.030843], abs=6e-7)
    cosines = np.cos([naive.von_mises(4.0) for _ in range(4000)])
    assert cosines.mean() == pytest.approx(0.8635, abs=0.01)
