"""The protocol of a stage, by the stage that docs/architecture.md adds."""

import hashlib
import re
import types
from dataclasses import replace

import pytest

from zfcal.artifacts.lineage import package_version, read_lineage
from zfcal.artifacts.lock import lock
from zfcal.artifacts.reading.contents import hash_of, read_bytes
from zfcal.artifacts.segments import segment_starts
from zfcal.artifacts.tables import read_tracks, write_tracks
from zfcal.errors import ChangedError, DamagedError, InputError, LockedError, TakenError
from zfcal.stages.events import LeftOut, Made, Note, Planned, Progress, UpToDate
from zfcal.stages.making import run
from zfcal.stages.stage import Draft, Item, OneThing, Output, Stage
from zfcal.stages.trial_context import Task

DRY, FORCED = Task(dry_run=True), Task(force=True)


@pytest.fixture(scope="module")
def page(repository):
    """Return the module that the page tells how to write."""
    text = (repository / "docs" / "architecture.md").read_text(encoding="utf-8")
    section = text.partition("\n## Add a stage\n")[2].partition("\n## ")[0]
    (source,) = re.findall(r"^```python\n(.*?)^```$", section, re.MULTILINE | re.DOTALL)
    module = types.ModuleType("thinning")
    exec(compile(source, "docs/architecture.md", "exec"), vars(module))  # noqa: S102 - our own page
    return module


@pytest.fixture
def root(make_trial):
    """Return a trial of three segments."""
    return make_trial(seconds=180)


@pytest.fixture
def other(make_trial):
    """Return a trial of other fish."""
    return make_trial("other", seconds=180, seed=2)


@pytest.fixture
def thin(page, root, heard):
    """Run the stage, and return what was told."""

    def thin(task=None, **options):
        heard.clear()
        run(page.Thin(**options), root, heard.append, task=task)
        return list(heard)

    return thin


@pytest.fixture
def meddle(page, root, other, monkeypatch):
    """Replace the first segment by one of other fish whenever it has been read, so many times."""
    source = root / "tracks" / "000000.parquet"
    contents = [place.read_bytes() for place in (other / "tracks" / source.name, source)]

    def meddle(times):
        seen = []

        def read(path):
            tracks = read_tracks(path)
            if path == source and len(seen) < times:
                seen.append(path)
                source.write_bytes(contents[(len(seen) - 1) % 2])
            return tracks

        monkeypatch.setattr(page, "read_tracks", read)
        return source

    return meddle


def names(events, kind):
    """Return the files that events of a kind are about."""
    return [event.path.name for event in events if isinstance(event, kind)]


def files(root):
    """Return what lies in a trial, by name; locks as well."""
    return {path: path.read_bytes() for path in root.rglob("*") if path.is_file()}


THREE = ["000000.parquet", "000060.parquet", "000120.parquet"]


def test_a_stage_makes_what_is_missing_and_then_nothing(thin, root):
    """Told file by file, with progress; the second run finds them up to date."""
    told = thin()
    assert names(told, Made) == THREE
    assert [each.reason for each in told if isinstance(each, Made)] == ["missing"] * 3
    progress = [(each.stage, each.done, each.total) for each in told if isinstance(each, Progress)]
    assert progress == [("segments", 1, 3), ("segments", 2, 3), ("segments", 3, 3)]
    assert set(read_tracks(root / "thin" / "000060.parquet").frame % 5) == {0}
    before = files(root)
    told = thin()
    assert (names(told, Made), names(told, UpToDate)) == ([], THREE)
    assert files(root) == before


def test_lineage_has_the_command_the_options_and_the_bytes_that_were_read(thin, root):
    """By which anybody can say where a file comes from."""
    thin(every=3)
    lineage = read_lineage(root / "thin" / "000060.parquet")
    digest = hashlib.sha256((root / "tracks" / "000060.parquet").read_bytes()).hexdigest()
    assert (lineage.command, lineage.version) == ("thin", package_version())
    assert (lineage.options, lineage.inputs) == ({"every": 3}, {"tracks/000060.parquet": digest})


def test_what_is_stale_is_made_again_and_nothing_else(thin, root, other):
    """An input or an option that changed, or force."""
    thin()
    source = root / "tracks" / "000060.parquet"
    source.write_bytes((other / "tracks" / source.name).read_bytes())
    told = thin()
    assert (names(told, Made), names(told, UpToDate)) == (THREE[1:2], [THREE[0], THREE[2]])
    reasons = [each.reason for each in told if isinstance(each, Made)]
    assert reasons == ["input tracks/000060.parquet changed"]
    told = thin(every=2)
    assert [each.reason for each in told if isinstance(each, Made)] == ["option every: 5 -> 2"] * 3
    assert names(thin(FORCED, every=2), Made) == THREE


def test_a_dry_run_says_why_and_writes_nothing(thin, root):
    """Not even a lock, nor with force."""
    before = files(root)
    told = thin(DRY)
    assert [each.reason for each in told if isinstance(each, Planned)] == ["missing"] * 3
    assert names(told, Made) == []
    thin(Task(dry_run=True, force=True))
    assert files(root) == before


def test_a_second_run_at_the_same_time_is_refused(thin, root):
    """The lock bears the stage's name; a dry run needs none."""
    with lock(root, "thin"):
        with pytest.raises(LockedError):
            thin()
        thin(DRY)
    with lock(root, "analyse"):
        thin()


def test_where_there_is_no_trial_no_lock_is_left(page, tmp_path):
    """The error names what is missing."""
    with pytest.raises(InputError):
        run(page.Thin(), tmp_path, print)
    assert list(tmp_path.iterdir()) == []


def test_a_thing_whose_input_changes_is_made_again_at_once(thin, meddle, other):
    """Of the new content, whose hash it bears; the old one leaves nothing."""
    source = meddle(1)
    told = thin()
    (note,) = (each for each in told if isinstance(each, Note))
    assert str(source) in note.text
    assert (names(told, Made), names(told, LeftOut)) == (THREE, [])
    made = source.parent.parent / "thin" / source.name
    assert set(read_lineage(made).inputs.values()) == {hash_of(source)}
    assert source.read_bytes() == (other / "tracks" / source.name).read_bytes()
    wanted = read_tracks(source)
    assert read_tracks(made).x_m.tolist() == wanted.take(wanted.frame % 5 == 0).x_m.tolist()


def test_a_thing_whose_input_changes_again_is_left_to_the_next_run(thin, meddle, root):
    """Told as damaged, for exit 3; the others are made, and the next run makes this one."""
    meddle(2)
    told = thin()
    (left_out,) = (each for each in told if isinstance(each, LeftOut))
    assert left_out.damaged
    assert left_out.path == root / "thin" / "000000.parquet"
    assert names(told, Made) == THREE[1:]
    assert not (root / "thin" / "000000.parquet").exists()
    assert names(thin(), Made) == THREE[:1]


def test_a_damaged_input_keeps_its_own_thing_away_and_no_other(thin, root):
    """It is named."""
    source = root / "tracks" / "000060.parquet"
    source.write_bytes(source.read_bytes()[:100])
    told = thin()
    assert names(told, Made) == [THREE[0], THREE[2]]
    (left_out,) = (each for each in told if isinstance(each, LeftOut))
    assert str(source) in left_out.problem


def test_a_folder_in_the_place_of_a_file_keeps_that_file_away_and_no_other(thin, root):
    """Before anything is computed for it."""
    (root / "thin" / "000060.parquet").mkdir(parents=True)
    told = thin()
    assert (names(told, LeftOut), names(told, Made)) == (THREE[1:2], [THREE[0], THREE[2]])


def copies(run, source, *, apart=False, finish=lambda: None):
    """Return two copies of a file as one thing."""
    lineage = run.lineage("zfcal.tracks/1", [source])
    pair = [Output(path=run.root / name / source.name, lineage=lineage) for name in ("a", "b")]

    def compute():
        tracks = read_tracks(source)
        for output in pair:
            yield Draft(output=output, write=lambda path, own: write_tracks(path, tracks, own))

    return Item(outputs=pair, compute=compute, finish=finish, apart=apart)


def copy_one(work=lambda: None, **how):
    """Return a stage that copies the first segment, and works on its way there."""

    def item(run):
        source = run.root / "tracks" / "000000.parquet"
        read_bytes(source)
        work()
        return copies(run, source, **how)

    return OneThing(name="copy", item=item)


def test_files_that_belong_together_are_made_together(root, heard):
    """Also the one that is up to date; of files apart only the one that is missing."""
    run(copy_one(), root, heard.append)
    for apart, made in ((False, ["a", "b"]), (True, ["b"])):
        (root / "b" / "000000.parquet").unlink()
        heard.clear()
        run(copy_one(apart=apart), root, heard.append)
        assert [each.path.parent.name for each in heard if isinstance(each, Made)] == made


@pytest.mark.parametrize("apart", [False, True])
def test_a_dry_run_plans_each_file_of_a_thing(root, heard, apart):
    """Where each is judged by itself as well."""
    before = files(root)
    assert run(copy_one(apart=apart), root, heard.append, task=DRY) == []
    assert [each.path.parent.name for each in heard if isinstance(each, Planned)] == ["a", "b"]
    assert files(root) == before


def test_what_finishes_a_thing_is_done_where_its_files_are_there(root, heard):
    """Made now or before, and not where a dry run would make them."""
    finished = []
    run(copy_one(finish=lambda: finished.append(1)), root, heard.append, task=DRY)
    assert finished == []
    for _ in range(2):
        there = run(copy_one(finish=lambda: finished.append(1)), root, heard.append)
        assert [path.parent.name for path in there] == ["a", "b"]
    assert len(finished) == 2


def test_one_thing_whose_input_changes_again_and_again_is_an_error(root, other, heard):
    """After a second attempt; nothing is published. One change is put up with."""
    source = root / "tracks" / "000000.parquet"
    contents = [(place / "tracks" / source.name).read_bytes() for place in (other, root)]
    attempts = []

    def work():
        attempts.append(1)
        source.write_bytes(contents[(len(attempts) - 1) % 2])

    with pytest.raises(ChangedError):
        run(copy_one(work), root, heard.append)
    assert len(attempts) == 2
    assert not (root / "a").exists()
    run(copy_one(lambda: None if len(attempts) > 2 else work()), root, heard.append)
    assert (root / "a" / "000000.parquet").exists()


def test_a_folder_in_the_place_of_the_only_thing_is_an_error(root, heard):
    """And no work is done for the file beside it."""
    (root / "b" / "000000.parquet").mkdir(parents=True)
    with pytest.raises(TakenError):
        run(copy_one(), root, heard.append)
    assert not (root / "a").exists()


class Shared(Stage):
    """Makes things that share a file, each of the same inputs."""

    name, counted = "shared", "things"

    def __init__(self, between, *, is_chain=False):
        self.is_chain, self.between, self.opened = is_chain, between, []

    def open(self, run):
        """Read it."""
        self.opened.append(read_bytes(run.root / "settings"))
        return run

    def items(self, shared):
        """Return the segments."""
        return segment_starts(shared.root)

    def place(self, shared, key):
        """Return the first copy."""
        return shared.root / "a" / f"{key:06d}.parquet"

    def item(self, shared, key):
        """Return the copies of a segment."""
        self.between(key)
        hash_of(shared.root / "settings")
        return copies(shared, shared.root / "tracks" / f"{key:06d}.parquet")


def test_what_things_share_is_read_again_where_it_has_changed(root, heard):
    """And no thing is made of two contents of it."""
    settings = root / "settings"
    settings.write_text("old")
    stage = Shared(lambda key: settings.write_text("new") if key == 60 else None)
    run(stage, root, heard.append)
    assert stage.opened == [b"old", b"new"]
    assert names(heard, Made) == [name for name in THREE for _ in range(2)]


def test_a_chain_ends_at_a_thing_that_is_left_out(root, heard):
    """What follows would start from another one than in the next run; others go on."""
    settings = root / "settings"
    for is_chain, made in ((True, THREE[:1]), (False, [THREE[0], THREE[2]])):
        contents = iter("12345678")

        def between(key, contents=contents):
            if key == 60:
                settings.write_text(next(contents))

        settings.write_text("0")
        heard.clear()
        run(Shared(between, is_chain=is_chain), root, heard.append, task=FORCED)
        assert sorted(set(names(heard, Made))) == made
        assert names(heard, LeftOut) == THREE[1:2]


def test_a_chain_ends_at_a_damaged_input(root, heard):
    """As an error; what came before it is there."""
    (root / "settings").write_text("x")
    source = root / "tracks" / "000060.parquet"
    source.write_bytes(source.read_bytes()[:100])
    with pytest.raises(DamagedError):
        run(Shared(lambda _: None, is_chain=True), root, heard.append)
    assert set(names(heard, Made)) == set(THREE[:1])


def test_files_of_another_version_stay_and_that_is_said_once(root, heard):
    """A new version of the package is no reason to make anything again."""

    def item(run):
        made = copies(run, root / "tracks" / "000000.parquet", apart=True)
        older = [
            replace(each, lineage=replace(each.lineage, version="0.0.1")) for each in made.outputs
        ]
        return replace(made, outputs=older)

    run(copy_one(apart=True), root, heard.append)
    heard.clear()
    run(OneThing(name="copy", item=item), root, heard.append)
    assert names(heard, Made) == []
    notes = [each.text for each in heard if isinstance(each, Note)]
    assert [text.partition(";")[0] for text in notes] == [
        f"{root / name}: made by {package_version()}, this is 0.0.1" for name in ("a", "b")
    ]
