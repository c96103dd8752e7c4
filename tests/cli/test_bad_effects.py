"""A model file with an effect that there is not, or a parameter that it has not, is named."""

import pytest

BAD = {
    "[effects.levitation]\n": "levitation",
    '[effects.alignment]\n"weight of it" = 1.0\n': "weight of it",
    "[effects.alignment]\nweight = 1e9\n": "weight must be in",
}


@pytest.mark.parametrize("text", BAD)
@pytest.mark.parametrize(
    "words",
    [
        ("simulate", "other", "--model", "bad.toml", "--arena", "two-rooms", "--fish", 3,
         "--duration", "2min"),
        ("simulate", "own", "--model", "bad.toml", "--duration", "2min", "--force"),
        ("diagnose", "own", "--model", "bad.toml", "--quick"),
        ("calibrate", "own", "--model", "bad.toml"),
    ],
    ids=lambda words: f"{words[0]} {words[1]}",
)  # fmt: skip
def test_the_file_of_a_bad_effect_is_named(zfcal, tmp_path, words, text):
    """In one line, before anything is made."""
    zfcal("init", "own", "--arena", "two-rooms", "--fish", 3, "--fps", 5, "--seed", 1)
    zfcal("simulate", "own", "--model", "own/models/000000.toml", "--duration", "2min")
    zfcal("analyse", "own")
    model = (tmp_path / "own" / "models" / "000000.toml").read_text(encoding="utf-8")
    (tmp_path / "bad.toml").write_text(model + text, encoding="utf-8")
    done = zfcal(*words)
    assert done.code == 1, done.err
    (line,) = (line for line in done.err.splitlines() if line.startswith("zfcal: error"))
    assert "bad.toml" in line
    assert BAD[text] in line
    assert not (tmp_path / "other").exists()
