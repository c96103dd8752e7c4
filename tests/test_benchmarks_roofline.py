"""What the roofline makes of its numbers, and that the plain program is the model."""

import math

import numpy as np
import pytest


@pytest.fixture(scope="module")
def roofline(scripts):
    """Return the script."""
    return scripts("bench_roofline")


FOUND = {
    "machine": "a machine", "load_before": 0.1, "load_after": 0.2, "words": 7.3,
    "ns": {"turn": 20.0, "word": 1.0, "angle": 5.0, "zone": 4.0, "wall": 8.0,
           "kernel": 220.0, "naive": 1100.0, "grid": 11_000.0},
    "scaling": {"one_s": 1.0, "two_s": 0.5, "ratio": 2.0},
}  # fmt: skip


def test_the_bound_adds_up_what_a_step_needs(roofline):
    """20 + 3 * 1 + 4 * 5 + 4 + 8 = 55 ns of 220 are a quarter."""
    text = " ".join(roofline.markdown(FOUND).split())

    assert "Together 55 ns" in text
    assert "the bound is 25 %" in text
    assert "| 1,100 | 5 |" in text
    assert "2.00 times as fast" in text


def test_the_kernel_is_compared_with_what_is_beside_it(roofline):
    """220 ns over 55, 1,100 and 11,000; two threads at twice the speed are better."""
    found = roofline.ratios(FOUND)
    assert [ratio.value for ratio in found.values()] == pytest.approx([4.0, 0.2, 0.02, 2.0])
    assert [ratio.better for ratio in found.values()] == ["less"] * 3 + ["more"]


def test_the_plain_programs_solid_angles_are_the_published_ones(roofline):
    """At 0.05 m ahead, headings 0, 45, 90 and 180 degrees."""
    found = [roofline.naive.solid_angle(0.05, 0.0, math.radians(a)) for a in (0, 45, 90, 180)]

    assert found == pytest.approx([0.052389, 0.048100, 0.037770, 0.030843], abs=6e-7)


def test_the_plain_programs_von_mises_angles_have_the_laws_mean(roofline):
    """Mean cosine at kappa 4 is I1 / I0 = 0.8635; 4,000 draws notice 1 %."""
    cosines = np.cos([roofline.naive.von_mises(4.0) for _ in range(4000)])

    assert cosines.mean() == pytest.approx(0.8635, abs=0.01)
