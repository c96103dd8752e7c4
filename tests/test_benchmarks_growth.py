"""What the growth benchmark makes of its numbers."""

import sys

import pytest


@pytest.fixture(scope="module")
def growth(scripts):
    """Return the script."""
    return scripts("bench_growth")


def test_the_exponent_of_a_square_is_two(growth):
    """Whatever the factor, and over the larger sizes only."""
    rows = [{"n": n, "cost": 7.0 * n**2 if n > 4 else 1.0} for n in (1, 2, 4, 8, 16, 32)]
    assert growth.slope(rows[2:], "n", "cost") == pytest.approx(2.0)


def test_pairs_cost_as_much_as_the_rest_where_the_lines_cross(growth):
    """200 ns and 10 ns for each other agent: with twenty others."""
    rows = [{"agents": n, "ns": 200.0 + 10.0 * (n - 1)} for n in (2, 5, 50, 500)]
    found = growth.crossing(rows, "ns")
    assert found["fixed_ns"] == pytest.approx(200.0)
    assert found["per_other_ns"] == pytest.approx(10.0)
    assert found["equal_at_agents"] == pytest.approx(21.0)


def test_a_table_has_a_line_per_row(growth):
    """Three digits, thousands set apart."""
    table = sys.modules["measuring"].table(("a", "b"), [[1.23456, 86_400], ["x", 1234.5]])
    assert table.splitlines() == ["| a | b |", "|---|---|", "| 1.23 | 86,400 |", "| x | 1,234 |"]


def test_roomy_tanks_give_everybody_the_same_room(growth):
    """As much as five agents have in two rooms."""
    for n in (5, 50, 500):
        assert growth.roomy(n).outline.area / n == pytest.approx(growth.AREA_M2 / 5)
    assert growth.two_rooms().outline.area == pytest.approx(growth.AREA_M2, rel=0.01)
