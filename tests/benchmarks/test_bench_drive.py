"""The benchmarks of the driver and of the closed loop, each run small."""

import subprocess
import sys

import pytest


@pytest.mark.slow
def test_the_benchmark_of_the_driver_runs(tiny):
    """From a pose to the state and from a tick to the last byte."""
    found, text = tiny("drive/bench_drive.py")
    assert set(found["latency"]) >= {"pose_to_state_s", "tick_to_byte_s"}
    assert "| pose written to state | " in text


@pytest.mark.slow
def test_the_cost_of_effects_is_measured(repository):
    """A step without any, and with each of three kinds."""
    script = repository / "benchmarks" / "drive" / "bench_drive.py"
    done = subprocess.run(
        [sys.executable, script, "--effects", "--tiny"], capture_output=True, text=True, check=True
    )
    for name in ("none", "alignment", "turning-bias", "crowding"):
        assert name in done.stdout


@pytest.mark.slow
def test_the_benchmark_of_the_closed_loop_runs(tiny, tmp_path):
    """A trial is kept; a second run takes it from there."""
    found, text = tiny("drive/bench_closed_loop.py", "--build", tmp_path / "trials")
    (trial,) = found["trials"]
    assert trial["kind"] == "fixed"
    again, _ = tiny("drive/bench_closed_loop.py", "--build", tmp_path / "trials", "--report")
    assert again["trials"] == found["trials"]
    assert "| " in text
