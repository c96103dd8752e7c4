"""What the older software is told over its settings port, and that it is sure to have heard it."""

import dataclasses
import importlib.util
import time
from pathlib import Path

import pytest

from zfcal.errors import InputError
from zfcal.parameters import natural
from zfcal.robot.cats import DT, Address, OlderRig, request, settings_of, understand

pytest.importorskip("zmq", reason="needs pyzmq: the extra zfcal[cats]")
_spec = importlib.util.spec_from_file_location(
    "older_rig", Path(__file__).with_name("older_rig.py")
)
older_rig = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(older_rig)

ZONES = ("corridor", "centre", "centre", "walls", "walls")
"""The five zones of the older rig with two rooms, as its settings file numbers them."""

MODEL = natural((("corridor", True), ("walls", True), ("centre", False)), dt_s=0.2)
FILE = {path: [0.5] * len(values) for path, values in settings_of(MODEL, ZONES).items()}


def path_of(number, name):
    """Return a path of the settings file."""
    return f"robots/fishModel/ZonedBM/zone_{number}/{name}"


def settle(rig, client, *, seconds=5.0, speed=1.0):
    """Let both talk until all is taken or the time is over; return what was told."""
    told, began_s = [], time.monotonic()
    while (passed_s := time.monotonic() - began_s) < seconds:
        told += client.look(speed * passed_s)
        if not client.missing and any("has taken" in text for text in told):
            break
        time.sleep(0.01)
    return told


@pytest.fixture
def client():
    """Return what connects to a rig, and leaves it at the end."""
    made = []

    def connect(rig):
        made.append(OlderRig(Address(host="127.0.0.1", port=rig.port), ZONES))
        return made[-1]

    yield connect
    for each in made:
        each.close()


def test_the_messages_by_hand():
    """Four frames: whom for, path, set or get, numbers with semicolons."""
    path = path_of(1, "kappaFishes")
    assert request(path, (1.5, 2.0)) == [b"cats", path.encode(), b"set", b"1.5;2"]
    assert request(path) == [b"cats", path.encode(), b"get", b""]
    assert understand([b"optimiser", path.encode(), b"set", b"1.5;2"]) == (path, (1.5, 2.0))


@pytest.mark.parametrize(
    "frames",
    [[], [b"a", b"b", b"set"], [b"a", b"b", b"get", b"1"], [b"a", b"\xff", b"set", b"1"],
     [b"a", b"b", b"set", b"1;x"]],
)  # fmt: skip
def test_what_is_no_answer_is_passed_over(frames):
    """Others may talk on that port."""
    assert understand(frames) is None


def test_a_model_as_settings_by_hand():
    """Zone 2 and 3 of the rig are both centres: each has the centre's numbers."""
    found = settings_of(MODEL, ZONES)
    corridor, walls, centre = MODEL.zones
    assert len(found) == 6 * 5
    assert found[path_of(1, "kappaNeutCenter")] == (corridor.kappa_0,)
    assert found[path_of(3, "kappaFishes")] == (centre.kappa_f,)
    assert found[path_of(4, "alphasCenter")] == (walls.alpha,)
    assert found[path_of(5, "speedHistogram")] == walls.speed_frequency
    own = [centre.gamma[zone] for zone in ZONES]
    assert list(found[path_of(2, "zonesAffinity")]) == own


def test_a_wall_of_its_own_concentration_and_one_without():
    """kappa_w where the model has it, else kappa_0."""
    walls = dataclasses.replace(MODEL.zones[1], kappa_w=17.0)
    with_walls = dataclasses.replace(MODEL, zones=(MODEL.zones[0], walls, MODEL.zones[2]))
    assert settings_of(with_walls, ZONES)[path_of(4, "kappaWalls")] == (17.0,)
    without = dataclasses.replace(walls, kappa_w=None)
    without = dataclasses.replace(MODEL, zones=(MODEL.zones[0], without, MODEL.zones[2]))
    assert settings_of(without, ZONES)[path_of(4, "kappaWalls")] == (walls.kappa_0,)


def test_a_zone_that_the_model_does_not_have():
    """It is named, with those that there are."""
    with pytest.raises(InputError, match=r"no zone ring, only corridor, walls, centre"):
        settings_of(MODEL, ("corridor", "ring"))
    with pytest.raises(InputError, match="none given"):
        settings_of(MODEL, ())


def test_addresses():
    """The port may be left out; answers come on the next one."""
    address = Address.parse("cats2://rig")
    assert (address.host, address.port) == ("rig", 5557)
    assert address.tcp(answers=True) == "tcp://rig:5558"
    assert str(Address.parse("cats2://[::1]:6000")) == "cats2://[::1]:6000"


@pytest.mark.parametrize(
    "text", ["rig", "tcp://rig:5557", "cats2://", "cats2://rig:0x1", "cats2://rig:65535",
             "cats2://rig/zone", "cats2://rig:99999"]
)  # fmt: skip
def test_what_is_no_address(text):
    """Says so, with an example."""
    with pytest.raises(InputError, match="is no address of a rig"):
        Address.parse(text)


def test_a_rig_takes_a_model(client):
    """All settings stand there as the model has them; it is told once, and within a second."""
    with older_rig.Rig(FILE) as rig:
        connected = client(rig)
        connected.offer(MODEL, 0.0)
        began_s = time.monotonic()
        told = settle(rig, connected)
        assert time.monotonic() - began_s < 1.0
        assert [text.partition(" has ")[2] for text in told] == ["taken 30 settings."]
        wanted = settings_of(MODEL, ZONES)
        for path, values in wanted.items():
            assert rig.settings[path] == pytest.approx(values, rel=1e-6)
        assert settle(rig, connected, seconds=0.2) == []


def test_a_rig_that_comes_late_and_one_that_has_forgotten_get_it_too(client):
    """Nothing that was sent into the void is lost; a rig that was started anew is told again."""
    with older_rig.Rig(FILE) as rig:
        port = rig.port
    connected = client(rig)
    connected.offer(MODEL, 0.0)
    for k in range(20):
        assert connected.look(0.1 * k) == []
        time.sleep(0.01)
    with older_rig.Rig(FILE, port=port) as rig:
        assert "has taken" in settle(rig, connected, speed=2.0)[0]
    with older_rig.Rig(FILE, port=port) as rig:
        ends_s = time.monotonic() + 10
        path = path_of(1, "kappaFishes")
        while rig.settings[path] == FILE[path]:
            # Twenty times as fast as the clock: what was taken is asked for every 10 s.
            connected.look(100 + 20 * time.monotonic())
            assert time.monotonic() < ends_s
            time.sleep(0.01)


def test_a_setting_that_is_not_taken_is_named(client):
    """After 10 s, with what the rig has instead."""
    path = path_of(1, "kappaFishes")
    with older_rig.Rig(FILE, deaf={path}) as rig:
        connected = client(rig)
        connected.offer(MODEL, 0.0)
        assert settle(rig, connected, seconds=1.0) == []
        (told,) = settle(rig, connected, seconds=0.3, speed=100)
        assert f"has not taken 1 of 30 settings, such as {path}: it says 0.5" in told
        assert connected.missing == {path}


def test_nobody_there_is_said_once(client):
    """After 10 s."""
    with older_rig.Rig(FILE) as rig:
        pass
    connected = client(rig)
    connected.offer(MODEL, 0.0)
    assert connected.look(9.9) == []
    assert "does not answer" in connected.look(10.1)[0]
    assert connected.look(30.0) == []


def test_another_step_is_a_warning(client):
    """The parameters hold for the step of the trial alone; the same step is no news."""
    with older_rig.Rig(FILE | {DT: [0.33]}) as rig:
        connected = client(rig)
        connected.offer(MODEL, 0.0)
        told = settle(rig, connected)
        told += settle(rig, connected, seconds=0.3)
        assert any("has a step of 0.33 s, the model holds for 0.2 s" in text for text in told)
    with older_rig.Rig(FILE | {DT: [0.2]}) as rig:
        connected = client(rig)
        connected.offer(MODEL, 0.0)
        told = settle(rig, connected) + settle(rig, connected, seconds=0.2)
        assert not any("step" in text for text in told)
