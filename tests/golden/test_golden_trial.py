"""A small trial through every stage gives the numbers that it gave before.

Whoever changes numbers on purpose writes them anew, and says in the commit which and why:

    python tests/golden/test_golden_trial.py

Values count to nine digits. Compiled code differs in the last ones between processors, and a search
makes much of little: the numbers are compared on the kind of processor that they were made on, and
names, forms, options and inputs of all artifacts everywhere.
"""

import hashlib
import json
import math
import os
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import llvmlite.binding
import pyarrow.parquet as pq
import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.mcap_files import Overview, read_messages
from zfcal.errors import ZfcalError

KNOWN = Path(__file__).with_name("trial.json")
SAMPLE = Path(__file__).resolve().parents[2] / "data-samples" / "two-rooms.csv.gz"
FEW = ("--generations", "1", "--population", "8")
COMMANDS = (
    ("demo", "loop", "--closed-loop", "--duration", "130s", "--generations", "1"),
    ("drive", "loop/trial", "--replay"),
    ("init", "trial", "--arena", "two-rooms", "--fish", "4", "--robot", "--fps", "15"),
    ("import", SAMPLE, "trial", "--format", "csv"),
    ("analyse", "trial"),
    ("calibrate", "trial", *FEW, "--runs", "1"),
    ("diagnose", "trial", "--quick"),
    ("extend", "trial", "--effect", "alignment", *FEW),
    ("report", "trial"),
)


def run_all(run, place):
    """Run every stage by its command in an empty folder, given what runs one there."""
    with tempfile.TemporaryDirectory() as kernels:
        # Compiled by these very commands: kernels that tests have compiled differ in last digits.
        for words in COMMANDS:
            run(place, "zfcal", *words, "--quiet", NUMBA_CACHE_DIR=kernels)


def digests_of(place):
    """Return for each artifact what it is made from, and a digest of its values."""
    found = {}
    for path in sorted(place.rglob("*")):
        name = path.relative_to(place).as_posix()
        if path.is_file() and not any(part.startswith(".") for part in Path(name).parts):
            found[name] = {"origin": origin_of(path), "values": digest_of(path)}
    return found


def origin_of(path):
    """Return the form, the options and the names of the inputs; None without lineage."""
    try:
        lineage = read_lineage(path)
    except ZfcalError:
        return None
    said = {"schema": lineage.schema, "command": lineage.command, "inputs": sorted(lineage.inputs)}
    return {**said, "options": rounded(lineage.options)}


def digest_of(path):
    """Return a digest of the values in an artifact; None for pages and pictures."""
    values = VALUES.get(path.suffix)
    if values is None:
        return None
    text = json.dumps(rounded(values(path)), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def of_json(path):
    """Return a document without hashes, which hold every digit."""
    document = json.loads(path.read_text())
    return {key: value for key, value in document.items() if key not in HASHED}


def of_toml(path):
    """Return a document without hashes."""
    document = tomllib.loads(path.read_text())
    return {key: value for key, value in document.items() if key not in HASHED}


def of_mcap(path):
    """Return how many messages there are by topic, and the JSON of those that have any."""
    counts, said = {}, []
    for channel, message in read_messages(path, Overview()):
        counts[channel.topic] = counts.get(channel.topic, 0) + 1
        if channel.message_encoding == "json":
            value = json.loads(message.data)
            # The hash of a model, and its text, hold every digit; how quick it was is no result.
            said.append({key: each for key, each in value.items() if key not in HASHED})
    return [counts, said]


HASHED = {"lineage", "files", "extended", "sha256", "text", "sources", "trials"}
VALUES = {
    ".parquet": lambda path: pq.read_table(path).to_pydict(),
    ".json": of_json,
    ".toml": of_toml,
    ".mcap": of_mcap,
}


def rounded(value):
    """Return a value with its numbers to nine digits."""
    if isinstance(value, dict):
        return {key: rounded(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(each) for each in value]
    if isinstance(value, float):
        return float(f"{value:.9g}") if math.isfinite(value) else str(value)
    return value


def processor():
    """Return the kind of processor that the kernels are compiled for."""
    return llvmlite.binding.get_host_cpu_name()


@pytest.mark.slow
def test_a_small_trial_gives_the_numbers_that_it_gave(installed, tmp_path):
    """Import, track, analyse, calibrate, drive, diagnose, extend and report, from the wheel."""
    known = json.loads(KNOWN.read_text())
    run_all(installed.run, tmp_path)
    found = digests_of(tmp_path)
    assert "<svg" in (tmp_path / "trial" / "report" / "index.html").read_text()
    installed.run(tmp_path, "zfcal", "check", "trial")
    assert "man1/zfcal.1" in installed.run(tmp_path, "zfcal", "--man", "man1")
    assert sorted(found) == sorted(known["artifacts"])
    for name, (wanted, now) in ((n, (known["artifacts"][n], found[n])) for n in found):
        assert now["origin"] == wanted["origin"], name
    if processor() == known["processor"]:
        changed = [n for n in found if found[n]["values"] != known["artifacts"][n]["values"]]
        assert changed == []


def test_digits_beyond_the_ninth_do_not_count_and_the_eighth_does():
    """In tables within tables as well."""
    assert rounded({"a": [1.00000000001, 2]}) == {"a": [1.0, 2]}
    assert rounded({"a": [1.0000001]}) != {"a": [1.0]}


def run_here(place, program, *words, **environment):
    """Run a command of this environment in a folder."""
    line = [Path(sys.executable).with_name(program), *map(str, words)]
    subprocess.run(line, cwd=place, env={**os.environ, **environment}, check=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        run_all(run_here, folder)
        document = {"processor": processor(), "artifacts": digests_of(Path(folder))}
    KNOWN.write_text(json.dumps(document, indent=1, sort_keys=True) + "\n")
