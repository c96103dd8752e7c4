"""A layout of Foxglove has a panel for what a trial has, and for nothing else."""

import pytest

from zfcal.writers.layout import Topics, foxglove_layout

BOUNDS = (0.0, 0.0, 1.0, 0.5)


def leaves(node):
    """Return the panels that a layout places."""
    if isinstance(node, str):
        return [node]
    return leaves(node["first"]) + leaves(node["second"])


@pytest.mark.parametrize("cameras", [(), ("below",), ("below", "overhead")])
@pytest.mark.parametrize("has_poses", [True, False])
@pytest.mark.parametrize("has_drive", [True, False])
def test_every_panel_is_placed_once(cameras, has_poses, has_drive):
    """And every place has its panel."""
    topics = Topics(cameras=cameras, has_poses=has_poses, has_drive=has_drive)
    if not topics:
        return
    made = foxglove_layout(topics, BOUNDS)
    assert sorted(leaves(made["layout"])) == sorted(made["configById"])
    assert ("Plot!wheels" in made["configById"]) == has_drive
    images = [name for name in made["configById"] if name.startswith("Image!")]
    assert images == [f"Image!{camera}" for camera in cameras]


def test_the_tank_is_seen_from_above_its_middle():
    """At a distance that shows all of it."""
    topics = Topics(cameras=(), has_poses=True, has_drive=False)
    camera = foxglove_layout(topics, BOUNDS)["configById"]["3D!tank"]["cameraState"]
    assert camera["targetOffset"] == [0.5, 0.25, 0.0]
    assert camera["distance"] >= 1.0
    assert camera["phi"] == 0.0


def test_nothing_to_show_is_nothing():
    """A trial without MCAP files."""
    assert not Topics(cameras=(), has_poses=False, has_drive=False)
