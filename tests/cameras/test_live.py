"""A live camera: arrival times, the newest images, going away and coming back."""

import itertools
import threading
import time

import cv2
import numpy as np
import pytest

from zfcal.cameras.live import QUEUE, ArrivalClock, LiveCamera
from zfcal.errors import InputError

FPS = 30.0


def jpegs(n):
    """Return images whose grey tells their number, four a step."""
    made = []
    for k in range(n):
        _, data = cv2.imencode(".jpg", np.full((48, 64, 3), 4 * (k % 60) + 8, np.uint8))
        made.append(data.tobytes())
    return made


def number_of(shot):
    """Return the number of an image, by its grey."""
    return round((float(shot.image.mean()) - 8) / 4)


def live(url, **changes):
    """Return the camera of an address."""
    return LiveCamera(url, clock=changes.pop("clock", ArrivalClock()), fps=FPS, **changes)


@pytest.mark.slow
def test_images_come_in_order_with_the_time_of_their_arrival(streaming):
    """All of them, a thirtieth of a second apart; when the camera is gone for good it is told."""
    with streaming.Camera(jpegs(40), fps=FPS) as camera:
        source = live(camera.url, patience_s=0.1)
        found = [(number_of(shot), shot.time_s) for shot in source.shots()]
    assert [number for number, _ in found] == list(range(40))
    steps = np.diff([time_s for _, time_s in found])
    assert np.median(steps) == pytest.approx(1 / FPS, rel=0.1)
    assert found[0][1] < 0.1
    assert "went away" in source.problems[0].says
    assert "the trial goes on" in source.problems[0].hint


def test_a_camera_that_comes_back_goes_on_with_a_note(streaming):
    """The images that passed meanwhile are missing, and the times go on."""
    with streaming.Camera(jpegs(60), fps=FPS) as camera:
        source = live(camera.url, patience_s=5.0)
        shots = source.shots()
        before = list(itertools.islice(shots, 10))
        camera.gone.set()
        time.sleep(0.2)
        threading.Timer(0.3, camera.gone.clear).start()
        after = next(shot for shot in shots if number_of(shot) > 20)
        source.stop()
    (note,) = source.notes
    assert "went away" in note
    assert "came back after" in note
    passed = number_of(after) - number_of(before[-1])
    assert after.time_s - before[-1].time_s == pytest.approx(passed / FPS, abs=0.15)


def test_who_is_slow_gets_the_newest_and_a_count_of_the_rest(streaming):
    """The queue holds 45 images; the oldest go."""
    with streaming.Camera(jpegs(60), fps=100.0) as camera:
        source = live(camera.url, patience_s=0.1)
        shots = source.shots()
        next(shots)
        time.sleep(1.2)
        rest = [number_of(shot) for shot in shots]
    assert len(rest) == QUEUE
    assert rest[-1] == 59
    assert source.dropped == 60 - 1 - QUEUE


def test_a_camera_that_is_not_there_is_named():
    """At once, not after half a minute."""
    begun_s = time.monotonic()
    with pytest.raises(InputError, match="no camera answers there"):
        next(live("http://127.0.0.1:9/x").shots())
    assert time.monotonic() - begun_s < 5


def test_a_device_that_is_not_there_is_named():
    """By number or by path."""
    for address in ("/dev/video97", "97"):
        with pytest.raises(InputError, match=f"{address}: no camera answers"):
            next(live(address).shots())


def test_a_clock_begins_with_the_first_question():
    """And goes by the computer's steady clock from there."""
    clock = ArrivalClock()
    time.sleep(0.05)
    asked, unix_s = time.monotonic(), time.time()
    first = clock.now()
    answered, unix_after_s = time.monotonic(), time.time()
    assert 0.0 <= first <= answered - asked
    time.sleep(0.05)
    later = time.monotonic() - answered
    assert later <= clock.now() <= time.monotonic() - asked
    assert unix_s - 1e-3 <= clock.started_unix_s <= unix_after_s + 1e-3


def test_a_clock_of_a_trial_that_goes_on_counts_what_passed():
    """It began a minute ago."""
    began = time.time() - 60
    now = ArrivalClock(began).now()
    assert 60 - 1e-3 <= now <= time.time() - began + 1e-3
