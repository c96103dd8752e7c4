"""Model files: written for people, read with care, fitted to an arena."""

import dataclasses
import json
import tomllib
from importlib.resources import files

import numpy as np
import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.lineage import Lineage
from zfcal.artifacts.models import (
    SCHEMA,
    newest_model,
    read_model,
    read_model_for,
    read_result,
    write_model,
)
from zfcal.errors import DamagedError, InputError, SchemaError
from zfcal.model.effects import all_effects, generic_effects
from zfcal.parameters import from_genes, natural

ZONES = (("corridor", True), ("walls", True), ("centre", False))


@pytest.fixture
def model():
    """Return a model of two-rooms."""
    return natural(ZONES, dt_s=0.2)


@pytest.fixture
def origin():
    """Return a lineage of a model."""
    return Lineage(schema=SCHEMA, command="calibrate", seed=1)


@pytest.fixture
def path(tmp_path, model, origin):
    """Return the path of a model file."""
    path = tmp_path / "models" / "000120.toml"
    write_model(path, model, origin)
    return path


@pytest.fixture
def two_rooms(tmp_path):
    """Return the default arena."""
    return load_arena("two-rooms", tmp_path)


def edit(path, old, new):
    """Replace a piece of a file as an editor would."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_a_model_comes_back_as_it_was(path, model):
    """To the last bit: simulations from the file repeat those from memory."""
    assert read_model(path) == model


def test_a_model_of_any_genes_comes_back_as_it_was(tmp_path, model, origin):
    """Shortest decimal numbers give back the same floating-point numbers."""
    genes = np.random.default_rng(1).uniform(size=18)
    genes[:3] = [1e-12, 1.0, 1 / 3]
    calibrated = from_genes(genes, model)
    write_model(tmp_path / "m.toml", calibrated, origin)

    assert read_model(tmp_path / "m.toml") == calibrated


def test_effects_come_back_with_their_parameters(tmp_path, model, origin):
    """In their order; one may have none."""
    extended = dataclasses.replace(model, effects={"turning-bias": {"bias": -0.1}, "alignment": {}})
    write_model(tmp_path / "m.toml", extended, origin)

    assert read_model(tmp_path / "m.toml") == extended
    assert list(read_model(tmp_path / "m.toml").effects) == ["turning-bias", "alignment"]


def test_every_effect_comes_back_from_a_file(tmp_path, model, origin):
    """Generic ones as well, whose names have colons; to the last bit, in their order."""
    every = (*generic_effects(), *all_effects())
    effects = {
        effect.name: {each.name: (each.low + each.default) / 3 for each in effect.parameters}
        for effect in every
    }
    extended = dataclasses.replace(model, effects=effects)

    write_model(tmp_path / "m.toml", extended, origin)

    found = read_model(tmp_path / "m.toml").effects
    assert found == effects
    assert list(found) == list(effects)
    assert '[effects."generic:heading:wall"]' in (tmp_path / "m.toml").read_text()


def test_effects_may_be_a_list_of_names(path, model):
    """An effect that is only named has no parameters in the file."""
    text = path.read_text()
    head, _, tail = text.partition("[effects]")
    path.write_text("effects = ['alignment']\n" + head + tail.partition("\n\n")[2])

    assert read_model(path) == dataclasses.replace(model, effects={"alignment": {}})


def test_kappa_w_is_written_only_where_a_zone_has_its_own(tmp_path, model, origin):
    """Elsewhere it is kappa_0, whatever that becomes."""
    walls = dataclasses.replace(model.zones[1], kappa_w=20.0)
    own = dataclasses.replace(model, zones=(model.zones[0], walls, model.zones[2]))
    write_model(tmp_path / "m.toml", own, origin)

    assert read_model(tmp_path / "m.toml") == own
    assert (tmp_path / "m.toml").read_text().count("kappa_w") == 1


def test_the_file_has_the_keys_of_the_contract(path):
    """As any program sees them that reads TOML."""
    document = tomllib.loads(path.read_text())

    assert document["schema"] == "zfcal.model/1"
    assert list(document["zones"]) == ["corridor", "walls", "centre"]
    assert document["zones"]["walls"]["gamma"] == {"corridor": 0.6, "walls": 0.5, "centre": 0.4}
    assert len(document["zones"]["walls"]["speed_frequency"]) == 10
    assert document["effects"] == {}
    assert document["dt_s"] == 0.2


def test_equal_models_make_equal_bytes(tmp_path, model, origin):
    """The file is a function of what it holds."""
    result = {"score": 0.8, "intervals": {"a": [0.1, 0.2]}}
    for name in "ab":
        write_model(tmp_path / f"{name}.toml", model, origin, result)

    assert (tmp_path / "a.toml").read_bytes() == (tmp_path / "b.toml").read_bytes()


def test_results_come_back_as_plain_numbers(tmp_path, model, origin):
    """NumPy's become Python's, None is left out, and a number after a table stays outside it."""
    result = {
        "intervals": {"walls.kappa_0": np.array([1.0, 2.5]), "unknown": None},
        "score": np.float64(0.8),
        "generations": np.int64(20),
        "flags": ["corridor.alpha"],
        "budget_s": None,
    }
    write_model(tmp_path / "m.toml", model, origin, result)

    assert read_result(tmp_path / "m.toml") == {
        "intervals": {"walls.kappa_0": [1.0, 2.5]},
        "score": 0.8,
        "generations": 20,
        "flags": ["corridor.alpha"],
    }


def test_a_model_without_result_has_an_empty_one(path):
    """Such as the starting model."""
    assert read_result(path) == {}


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("kappa_0 =", "kapa_0 =", "unknown key 'kapa_0' in zones.corridor"),
        ("alpha = 17.0", "alpha = -1", "zones.corridor.alpha must be at least 0, got -1"),
        ("alpha = 17.0", "alpha = inf", "alpha must be finite"),
        ("alpha = 17.0", "alpha = nan", "alpha must be finite"),
        ("alpha = 17.0", "alpha = 'x'", "zones.corridor.alpha must be a number"),
        ("dt_s = 0.2", "dt_s = 0", "dt_s must be more than 0"),
        ("fov_rad = 2.3", "fov_rad = 135 #", "fov_rad must be at most 3.14"),
        ("speed_frequency = [", "speed_frequency = [0.1, ", "must be a list of at most 10"),
        ("speed_frequency = [0.03", "speed_frequency = [0.53", "sum to 1"),
        ("{corridor = 0.6", "{corridr = 0.6", "gamma names 'corridr', which is no zone"),
        ("{corridor = 0.6, ", "{", "zones.corridor.gamma lacks zone 'corridor'"),
        ("[zones.walls]", "[zones.wall]", "gamma names 'walls', which is no zone"),
    ],
)
def test_a_wrong_model_is_named_with_its_file(path, old, new, says):
    """One line that says what, where, expected and got."""
    edit(path, old, new)

    with pytest.raises(InputError, match=says.replace("[", r"\[")) as caught:
        read_model(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("base", "hint"),
    [
        ("zoned-visions", "Did you mean 'zoned-vision'? base: Name of the base model."),
        ("log-linear", "base: Name of the base model."),
        ("", "base: Name of the base model."),
    ],
)
def test_a_base_model_that_is_not_known_is_refused(path, base, hint):
    """Simulations would be of another model than the file says; the known one is named."""
    edit(path, 'base = "zoned-vision"', f'base = "{base}"')

    with pytest.raises(InputError) as caught:
        read_model(path)
    assert str(caught.value) == f'{path}: base must be "zoned-vision", got "{base}".'
    assert caught.value.hint == hint


def test_the_base_of_a_new_model_is_known(model):
    """A model file has the base that a model has unless told, and no other yet."""
    schema = json.loads((files("zfcal.schemas") / "model.schema.json").read_text())

    assert schema["properties"]["base"]["enum"] == [model.base]


@pytest.mark.parametrize("share", [0.0, 0.2, 0.4])
def test_a_model_that_was_cut_is_named(path, share):
    """Half a line is no TOML; a cut between lines leaves something out."""
    text = path.read_text()
    path.write_text(text[: int(len(text) * share)])

    with pytest.raises((DamagedError, InputError), match=str(path)):
        read_model(path)


def test_another_schema_is_refused(path):
    """A trial.toml, say."""
    edit(path, "zfcal.model/1", "zfcal.trial/1")

    with pytest.raises(SchemaError, match=r"expected 'zfcal\.model/1'"):
        read_model(path)


def test_a_lineage_of_another_schema_is_refused(tmp_path, model, lineage):
    """The file's schema stands at its head, so it must be that of a model."""
    with pytest.raises(InputError, match=r"zfcal\.model/1"):
        write_model(tmp_path / "m.toml", model, lineage)
    assert list(tmp_path.iterdir()) == []


def test_a_model_gets_the_arenas_order_of_zones(tmp_path, model, origin, two_rooms):
    """Zone ids count in the arena's order, whatever the file's."""
    turned = dataclasses.replace(model, zones=model.zones[::-1])
    write_model(tmp_path / "m.toml", turned, origin)

    found = read_model_for(tmp_path / "m.toml", two_rooms, dt_s=0.2)

    assert found.zone_names == two_rooms.zone_names
    np.testing.assert_array_equal(found.gamma_matrix(), model.gamma_matrix())


def test_a_model_without_a_zone_of_the_arena_is_refused(path, tmp_path):
    """The zone is named, and what the file calls it perhaps."""
    ring = load_arena("ring", tmp_path)

    with pytest.raises(InputError, match="zone 'inner' of arena 'ring' is missing"):
        read_model_for(path, ring, dt_s=0.2)


def test_a_model_with_a_zone_too_many_is_refused(path, tmp_path):
    """The circular tank has walls and centre, and no corridor."""
    circular = load_arena("circular", tmp_path)

    with pytest.raises(InputError, match="'circular' has no zone 'corridor'"):
        read_model_for(path, circular, dt_s=0.2)


def test_a_model_of_another_step_is_refused(path, two_rooms):
    """It would be another process than the one that was fitted."""
    with pytest.raises(InputError, match=r"holds for dt_s = 0.2 s, the trial has 0.333333 s"):
        read_model_for(path, two_rooms, dt_s=1 / 3)


def test_the_newest_model_has_the_highest_number(trial, model, origin):
    """As a number, not as text, and no name without a number."""
    for name in ("999960.toml", "1000020.toml", "extended.toml", "zzz.toml", ".2000000.toml"):
        write_model(trial.root / "models" / name, model, origin)

    assert newest_model(trial).name == "1000020.toml"


def test_a_trial_without_models_has_no_newest(trial):
    """The hint says how to get one."""
    (trial.root / trial.model).unlink()

    with pytest.raises(InputError, match="holds no numbered model") as caught:
        newest_model(trial)
    assert "zfcal calibrate" in caught.value.hint
