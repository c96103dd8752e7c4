"""What the benchmark of long trials makes of its numbers."""

import argparse

import pytest


@pytest.fixture(scope="module")
def long(scripts):
    """Return the script."""
    return scripts("bench_long")


def row(command, processor_s, peak_mb):
    """Return the row of a command."""
    return {"command": command, "now": {"processor_s": processor_s, "peak_mb": peak_mb}}


def test_commands_are_compared_with_the_import(long):
    """Or with the simulation where nothing was imported; time, then memory."""
    short = [row("simulate", 9.0, 9.0), row("import, from CSV", 2.0, 200.0)]
    lengths = [
        {"name": "short", "rows": [*short, row("analyse", 1.0, 100.0), row("check", 0.5, 50.0)]},
        {"name": "day", "rows": [row("simulate", 4.0, 300.0), row("analyse", 32.0, 150.0)]},
    ]
    found = {name: ratio.value for name, ratio in long.ratios({"lengths": lengths}).items()}
    assert found == {
        "short, time: analyse over import, from CSV": 0.5,
        "short, time: check over import, from CSV": 0.25,
        "short, memory: analyse over import, from CSV": 0.5,
        "short, memory: check over import, from CSV": 0.25,
        "day, time: analyse over simulate": 8.0,
        "day, memory: analyse over simulate": 0.5,
    }


@pytest.mark.parametrize(
    ("asked", "durations"),
    [("", ["30min"]), ("day", ["30min", "24h"]), ("write", ["30min", "24h"]), ("tiny", ["3min"])],
)
def test_a_day_is_measured_when_it_is_asked_for(long, asked, durations):
    """And for what is committed, which has one."""
    options = argparse.Namespace(tiny=False, day=False, write=False)
    vars(options).update({asked: True} if asked else {})
    assert [length.duration for length in long.lengths_of(options)] == durations
