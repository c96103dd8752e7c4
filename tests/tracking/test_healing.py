"""A tank that was learnt with something in it is mended by what frames show later."""

import numpy as np
import pytest

from zfcal.tracking.background import Background
from zfcal.tracking.healing import Healer, healed

HAND = np.s_[50:110, 40:120]


def tank_of(level):
    """Return a tank whose camera has a noise of two greys."""
    return Background(level=level, low=level - np.uint8(8), high=level + np.uint8(8))


def with_hand(grey, tank=180):
    """Return an even tank with a hand in it."""
    level = np.full((200, 200), tank, np.uint8)
    level[HAND] = grey
    return tank_of(level)


@pytest.mark.parametrize("grey", [60, 235])
@pytest.mark.parametrize("region", [False, True])
def test_a_hand_that_has_left_is_healed_with_fish_over_its_ghost(drawn, grey, region):
    """Dark or light: within the noise, with the noise that it had, and nothing else changes."""
    tank = with_hand(grey)
    where = np.zeros((200, 200), bool)
    where[20:180, 20:180] = True
    frames = [frame.image for frame in drawn.frames(drawn.circling(60, radius=30.0, turn=0.3))]
    mended = healed(tank, frames[::8], where if region else None)
    assert np.abs(mended.level.astype(int) - 180).max() <= 8
    for name in ("low", "high"):
        width = np.abs(getattr(mended, name).astype(int) - mended.level)
        assert (width.min(), width.max()) == (8, 8)
    np.testing.assert_array_equal(mended.level[150:], tank.level[150:])


def test_nothing_is_healed_outside_the_region_but_a_blurred_edge():
    """What animals cannot reach is not looked at."""
    tank, where = with_hand(235), np.zeros((200, 200), bool)
    where[:, :80] = True
    frame = np.full((200, 200), 180, np.uint8)
    mended = healed(tank, [frame] * 4, where)
    assert np.all(mended.level[:, :80] == 180)
    assert np.all(mended.level[HAND][:, 45:] == 235)


def test_one_look_is_not_enough():
    """In three of four looks it has to be a ghost."""
    tank, healer = with_hand(235), Healer()
    frame = np.full((200, 200), 180, np.uint8)
    assert healer.look(frame, tank) is tank
    assert healer.look(tank.level, tank) is tank
    assert healer.look(frame, tank) is tank
    assert np.all(healer.look(frame, tank).level == 180)


def test_an_animal_that_rests_is_never_healed_away(drawn):
    """However long: its edge is in the frame."""
    tank = tank_of(np.full((200, 200), 180, np.uint8))
    frames = [frame.image for frame in drawn.frames([[(60, 60, 0.3), (120, 90, 2.0)]] * 40)]
    assert healed(tank, frames) is tank


def test_what_comes_later_and_stays_is_not_healed():
    """A net that is put in is there."""
    tank = tank_of(np.full((200, 200), 180, np.uint8))
    assert healed(tank, [with_hand(60).level] * 8) is tank


def test_a_fish_that_sat_while_the_tank_was_learnt_is_healed(drawn):
    """Its bright ghost goes, and the fish are found where it was."""
    tank = tank_of(drawn.image([(60, 60, 0.3)], noise=0.0))
    frames = [frame.image for frame in drawn.frames([[(150, 60 + k, 1.0)] for k in range(5)])]
    assert np.abs(healed(tank, frames).level.astype(int) - 180).max() <= 10


def test_frames_of_another_brightness_heal_the_same():
    """A lamp that is dimmed by a fifth meanwhile."""
    tank = with_hand(235)
    frame = np.full((200, 200), 144, np.uint8)
    assert np.abs(healed(tank, [frame] * 4).level.astype(int) - 180).max() <= 2


def test_the_negative_heals_to_the_negative(drawn):
    """Nothing depends on what is dark and what is light."""
    tank = with_hand(100)
    frames = [frame.image for frame in drawn.frames(drawn.circling(6, turn=0.4))]
    one = healed(tank, frames)
    other = healed(tank.inverted(), [~frame for frame in frames])
    np.testing.assert_allclose(other.level.astype(int), ~one.level, atol=1)
