"""What the page costs, with a trial of half an hour and five agents that grows at 15 Hz."""

import http.client
import os
import shutil
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from zfcal.tracks import FramePoses
from zfcal.view.process import Page

MINUTES = 30
FPS = 15
MOST_RATIO = 4.0
"""As often as writing them; 2.6 as measured."""
LEAST_HZ = 5
MEASURED_S = 12


def seconds_of(process):
    """Return the processor time that a process has taken."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.fixture
def half_hour(trial, made):
    """Return a trial of 29 whole minutes with rounds, poses and the log of a driver."""
    for minute in range(3, MINUTES - 1):
        shutil.copy(
            trial / "tracks" / "000060.parquet", trial / "tracks" / f"{60 * minute:06d}.parquet"
        )
        made["round"](trial, 60 * minute, 0.8)
    with made["poses"](trial, 0) as writer:
        for n in range(60 * FPS):
            writer.add(five(made, n))
    first = trial / "poses" / "000000.mcap"
    for minute in range(1, MINUTES - 1):
        shutil.copy(first, trial / "poses" / f"{60 * minute:06d}.mcap")
    return trial


def five(made, n):
    """Return a frame of five agents."""
    poses = made["poses_at"](n / FPS)
    return FramePoses(time_s=n / FPS, frame=n, agents=(*poses.agents, *poses.agents)[:5])


@pytest.mark.slow
def test_to_follow_a_trial_costs_as_little_as_to_write_it(half_hour, made):
    """Processor time beside that of the writer, in one run: a slow computer slows down both."""
    start_s = 60 * (MINUTES - 1)
    over = threading.Event()
    written_s = []

    def grow():
        n, began_s = 0, time.monotonic()
        drive = made["drive"](half_hour, start_s)
        with made["poses"](half_hour, start_s) as writer:
            while not over.is_set():
                writer.add(five(made, start_s * FPS + n))
                drive.add(made["target"](start_s + n / FPS, 0.5, 0.5))
                drive.flush()
                written_s.append(time.thread_time())
                n += 1
                time.sleep(max(0.0, began_s + n / FPS - time.monotonic()))
        drive.close()

    with Page(half_hour, 0) as page:
        parts = urlsplit(page.url)
        line = http.client.HTTPConnection(parts.hostname, parts.port, timeout=120)
        line.request("GET", parts.path + "events")
        answer = line.getresponse()
        growing = threading.Thread(target=grow)
        growing.start()
        n_updates, began_s, spent_s = 0, None, 0.0
        try:
            warm_s = time.monotonic() + 8
            while began_s is None or time.monotonic() < began_s + MEASURED_S:
                is_pose = answer.readline() == b"event: pose\n"
                if began_s is not None:
                    n_updates += is_pose
                elif time.monotonic() > warm_s:
                    began_s, spent_s = time.monotonic(), seconds_of(page._process.pid)
            spent_s = seconds_of(page._process.pid) - spent_s
        finally:
            over.set()
            growing.join()
    hz, share = n_updates / MEASURED_S, spent_s / MEASURED_S
    ratio = share / (FPS * written_s[-1] / len(written_s))
    print(  # noqa: T201 - for -s
        f"\n{hz:.1f} updates a second, {100 * share:.1f} % of a core,"
        f" {ratio:.1f} times what writing takes"
    )
    assert ratio < MOST_RATIO
    assert hz >= LEAST_HZ
