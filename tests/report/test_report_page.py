"""The report on disk: whole, the same every time, and honest about what is missing."""

import html.parser
import json
import re
import shutil

import pytest

from zfcal.artifacts.lineage import read_lineage
from zfcal.artifacts.validation import check, read_json
from zfcal.errors import InputError, StorageError
from zfcal.report import page
from zfcal.report.options import Printing, ReportOptions
from zfcal.report.page import report_files, report_left_out, report_reason, write_report

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_model")]

quickly = pytest.mark.usefixtures("quick_pictures")

PICTURES = {
    "arena",
    "integration",
    "parameters",
    "presence",
    "scores",
    "search",
    "social",
    "statistics",
    "tracks",
}


class Reader(html.parser.HTMLParser):
    """What a page refers to, its ids and its text; its tags must close."""

    VOID = frozenset({"meta", "link", "br", "img", "path", "rect", "circle", "use", "image"})

    def __init__(self):
        super().__init__()
        self.links, self.ids, self.text, self.open = [], [], [], []

    def handle_starttag(self, tag, attrs):
        """Note what a tag refers to."""
        values = dict(attrs)
        self.links += [values[key] for key in ("href", "src", "xlink:href") if values.get(key)]
        self.ids += [values["id"]] if "id" in values else []
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        """Note a tag that closes itself."""
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        """Check that the last open tag is closed."""
        if tag not in self.VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        """Note text."""
        self.text.append(data)


def read_page(folder):
    """Return what a page holds, having read it to its end."""
    reader = Reader()
    reader.feed((folder / "index.html").read_text(encoding="utf-8"))
    reader.close()
    assert reader.open == []
    return reader


def contents(folder):
    """Return the bytes of all files of a folder."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_whole_trial_has_page_pictures_and_numbers(drawn_trial):
    """The page comes first, the numbers last; nothing else is left behind."""
    made = report_files([drawn_trial])

    assert made[0].name == "index.html"
    assert made[-1].name == "integration.json"
    assert {path.stem for path in made[1:-1]} == PICTURES
    assert set(made) == set((drawn_trial / "report").iterdir())


def test_the_page_stands_by_itself(drawn_trial):
    """It loads nothing: links lead to places on it and to the pictures beside it."""
    folder = drawn_trial / "report"
    reader = read_page(folder)
    outside = [
        link
        for link in reader.links
        if not link.startswith(("#", "data:")) and not (folder / link).is_file()
    ]

    assert outside == []
    assert len(reader.ids) == len(set(reader.ids))
    assert {link[1:] for link in reader.links if link.startswith("#")} <= set(reader.ids)
    text = (folder / "index.html").read_text(encoding="utf-8")
    assert "@import" not in text
    assert not re.search(r"url\((?!#)", text)
    assert "prefers-color-scheme: dark" in text


def test_the_same_trial_has_the_same_bytes_wherever_it_lies(drawn_trial, tmp_path, monkeypatch):
    """Made again from another folder, under a relative path: not a byte differs."""
    copy = tmp_path / "elsewhere" / "trial"
    shutil.copytree(drawn_trial, copy, ignore=shutil.ignore_patterns("report"))
    monkeypatch.chdir(copy.parent)

    write_report([copy.relative_to(copy.parent)])

    assert contents(copy / "report") == contents(drawn_trial / "report")


def test_the_numbers_fit_their_schema_and_carry_their_lineage(drawn_trial):
    """integration.json says what the report was made from, and so does the page."""
    folder = drawn_trial / "report"
    document = read_json(folder / "integration.json")

    check(document, "integration", "here")
    lineage = read_lineage(folder / "integration.json")
    assert lineage.command == "report"
    assert "tracks/000000.parquet" in lineage.inputs
    assert document["trials"][0]["robot_vs_fish"]["features"]["S"]["value"] == 0.7
    text = (folder / "index.html").read_text(encoding="utf-8")
    embedded = re.search(r'id="provenance">(.*?)</script>', text, re.DOTALL).group(1)
    assert json.loads(embedded) == lineage.as_dict()


@quickly
def test_a_report_is_up_to_date_until_something_changes(small_trial):
    """Missing, then up to date, then told what has changed."""
    root = small_trial()
    assert report_reason([root]) == "missing"

    made = write_report([root])
    assert report_reason([root]) is None
    assert set(report_files([root])) == set(made)
    assert report_files([root])[0] == made[0]

    (root / "report" / "scores.png").write_bytes(b"")
    assert report_reason([root]) == "scores.png was changed"
    (root / "report" / "scores.png").unlink()
    assert report_reason([root]) == "scores.png is missing"

    (root / "scores" / "000240.parquet").unlink()
    assert report_reason([root]) == "input scores/000240.parquet is gone"


@quickly
@pytest.mark.parametrize(
    ("parts", "pictures", "command"),
    [
        ({"analysed": False, "calibrated": False}, {"arena", "tracks"}, "zfcal analyse trial"),
        (
            {"calibrated": False},
            {"arena", "tracks", "statistics", "integration", "social"},
            "zfcal calibrate trial",
        ),
        ({"minutes": 2}, PICTURES, "There is a single window"),
        ({"n_robots": 0}, PICTURES - {"integration", "social"}, "There is no robot in this trial."),
    ],
    ids=["tracks only", "no model", "one window", "no robot"],
)
def test_missing_pieces_make_a_sensible_page(small_trial, parts, pictures, command):
    """What is there is shown, and the page says what is not and how to make it."""
    root = small_trial(**parts)

    made = write_report([root])

    assert {path.stem for path in made if path.suffix == ".png"} == pictures
    assert command in " ".join(read_page(root / "report").text)


@quickly
def test_a_trial_without_tracks_has_a_page(small_trial):
    """The arena, and where to begin."""
    root = small_trial(analysed=False, calibrated=False)
    shutil.rmtree(root / "tracks")

    made = write_report([root])

    assert {path.name for path in made} == {"index.html", "arena.png", "integration.json"}
    assert "zfcal import" in " ".join(read_page(root / "report").text)


@quickly
def test_damage_is_heard_of_and_shown(small_trial):
    """A broken segment is named on the page and to the caller; the rest is there."""
    root = small_trial()
    (root / "tracks" / "000060.parquet").write_bytes(b"PAR1")
    heard = []

    write_report([root], on_damage=heard.append)

    assert len(heard) == 1
    text = " ".join(read_page(root / "report").text)
    assert "Left out" in text
    assert "tracks/000060.parquet" in text
    (again,) = report_left_out([root])
    assert again.startswith(f"{root}: tracks/000060.parquet: ")


@quickly
def test_of_several_trials_the_damaged_one_is_named(small_trial, tmp_path):
    """Whoever asks again what a report leaves out hears of which trial it is."""
    roots = [small_trial("one"), small_trial("two")]
    (roots[1] / "tracks" / "000060.parquet").write_bytes(b"PAR1")
    write_report(roots, tmp_path / "both")
    (line,) = report_left_out(roots, tmp_path / "both")
    assert line.startswith(f"{roots[1]}: ")


@quickly
def test_several_trials_make_one_report(small_trial, tmp_path):
    """Means over trials, a row for each, in a folder of its own."""
    roots = [small_trial("one"), small_trial("two")]
    out = tmp_path / "out"

    made = write_report(roots, out)

    assert {path.parent for path in made} == {out}
    assert {path.stem for path in made if path.suffix == ".png"} == {
        "scores",
        "integration",
        "social",
        "arena",
    }
    text = " ".join(read_page(out).text)
    assert "2 trials" in text
    assert "compared,feature,end_s,n,mean,sd" in (out / "intervals.csv").read_text()
    assert out / "intervals.csv" in made
    assert [row["trial"] for row in read_json(out / "integration.json")["trials"]] == ["one", "two"]
    assert report_reason(roots, out) is None
    assert report_reason(roots[::-1], out) is not None


@quickly
def test_one_trial_can_be_reported_elsewhere(small_trial, tmp_path):
    """With a folder given, the trial stays as it is."""
    root = small_trial()

    write_report([root], tmp_path / "out")

    assert not (root / "report").exists()
    assert report_reason([root], tmp_path / "out") is None


@quickly
def test_what_cannot_be_one_report_is_refused(small_trial, tmp_path):
    """No trial, several without a folder, and the same one twice."""
    root = small_trial()

    with pytest.raises(InputError, match="at least one trial"):
        write_report([])
    with pytest.raises(InputError, match="needs a folder"):
        write_report([root, small_trial("other")])
    with pytest.raises(InputError, match="named twice"):
        write_report([root, tmp_path / "trial" / ".." / "trial"], tmp_path / "out")


@quickly
def test_trials_of_different_zones_are_not_pooled(small_trial, tmp_path):
    """A disc and two rooms have no common figure."""
    roots = [small_trial("one"), small_trial("two", analysed=False, calibrated=False)]
    config = roots[1] / "trial.toml"
    config.write_text(
        config.read_text(encoding="utf-8").replace('"two-rooms"', '"circular"'), encoding="utf-8"
    )

    with pytest.raises(InputError, match="zones"):
        write_report(roots, tmp_path / "out")


@quickly
def test_a_picture_that_is_no_longer_made_is_removed(small_trial):
    """The parameters of models that are gone would pass for current; notes of people stay."""
    root = small_trial()
    write_report([root])
    (root / "report" / "notes.png").write_bytes(b"mine")
    for path in (root / "models").iterdir():
        path.unlink()

    write_report([root])

    names = {path.name for path in (root / "report").iterdir()}
    assert "parameters.png" not in names
    assert "notes.png" in names


@quickly
def test_a_place_that_cannot_be_written_is_an_error(small_trial):
    """A file where the folder should be."""
    root = small_trial()
    (root / "report").write_bytes(b"")

    with pytest.raises(StorageError, match="report"):
        write_report([root])


@quickly
def test_a_report_that_breaks_off_is_made_again(small_trial, monkeypatch):
    """The numbers come last: without them the report counts as missing."""
    root = small_trial()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(page, "write_text_whole", full)
    with pytest.raises(OSError, match="No space"):
        write_report([root])

    assert report_reason([root]) == "missing"
    assert not list((root / "report").glob(".*"))


@quickly
def test_names_of_people_are_text(small_trial):
    """A trial may be called anything: markup in its name or source is shown, not followed."""
    root = small_trial("<img src=x onerror=alert(1)> & co", analysed=False, calibrated=False)
    config = root / "trial.toml"
    config.write_text(
        config.read_text(encoding="utf-8").replace(
            'source = ""', 'source = "</script><script>alert(2)</script>"'
        ),
        encoding="utf-8",
    )

    write_report([root])

    reader = read_page(root / "report")
    assert "x" not in reader.links
    assert "<img src=x onerror=alert(1)> & co" in " ".join(reader.text)
    text = (root / "report" / "index.html").read_text(encoding="utf-8")
    assert text.count("<script") == 1
    assert "\\u003cimg" in text.split('id="provenance">')[1]


@pytest.mark.usefixtures("quick_model", "quick_pictures")
def test_figures_have_the_formats_that_are_asked_for(small_trial):
    """Each in each format, all known to the report; another set takes the place of the first."""
    root = small_trial()
    how = ReportOptions(printing=Printing(formats=("svg", "pdf"), width_mm=85.0))

    made = write_report([root], how=how)

    assert {path.suffix for path in made} == {".html", ".json", ".svg", ".pdf"}
    assert report_reason([root], how=how) is None
    assert report_reason([root]) is not None
    text = (root / "report" / "index.html").read_text()
    assert "<code>scores.svg</code>, <code>scores.pdf</code>" in text
    write_report([root])
    assert not list((root / "report").glob("*.svg"))


def test_a_page_has_no_link_that_leaves_it(drawn_trial):
    """It can be sent by itself: what it names is in it, and each picture has a text."""
    text = (drawn_trial / "report" / "index.html").read_text()

    assert not re.findall(r'(?:src|href)="(?!#|data:)', text)
    assert "http" not in re.sub(r'xmlns(?::xlink)?="[^"]*"', "", text.split("</style>", 1)[1])
    drawn = re.findall(r"<svg (?![^>]*aria-hidden)[^>]*>", text)
    assert len(drawn) > 20
    assert all(re.search(r'role="img" aria-label="[^"]{20,}"', element) for element in drawn)


@pytest.mark.usefixtures("quick_model", "quick_pictures")
def test_published_scores_are_shown_where_asked_for(small_trial):
    """And an older report without them is not up to date then."""
    root = small_trial()
    write_report([root])
    how = ReportOptions(published=True)
    assert report_reason([root], how=how) is not None
    write_report([root], how=how)
    assert "published S (10 trials)" in (root / "report" / "index.html").read_text()
    write_report([root])
    assert "published S (10 trials)" not in (root / "report" / "index.html").read_text()
