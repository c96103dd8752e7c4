"""The page's server over real HTTP: who may look, what is answered, and how it ends."""

import asyncio
import contextlib
import http.client
import json
import math
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
from urllib.parse import urlsplit

import pytest

from zfcal.artifacts.arenas import load_arena
from zfcal.artifacts.settings import read_trial
from zfcal.errors import InputError
from zfcal.view.process import Page
from zfcal.view.station import Station

STARTS_S = 60


@pytest.fixture(scope="module")
def page(kept):
    """Return a page of a trial, served."""
    with Page(kept, 0) as served:
        yield served


@pytest.fixture
def own_page(trial):
    """Return a page of a trial that a test may do with as it likes."""
    with Page(trial, 0) as served:
        yield served


def ask(page, path="", *, method="GET", host=None, whole=False):
    """Return the answer to one question; `path` follows the secret unless it is whole."""
    parts = urlsplit(page.url)
    line = http.client.HTTPConnection(parts.hostname, parts.port, timeout=STARTS_S)
    line.putrequest(method, path if whole else parts.path + path, skip_host=True)
    if host != "":
        line.putheader("Host", host or parts.netloc)
    line.endheaders()
    answer = line.getresponse()
    is_endless = answer.getheader("content-type", "").startswith("text/event-stream")
    answer.text = "" if is_endless else answer.read().decode()
    return answer


def hear(page):
    """Return what a page hears until all was looked at once: pairs of kind and value."""
    parts = urlsplit(page.url)
    line = http.client.HTTPConnection(parts.hostname, parts.port, timeout=STARTS_S)
    line.request("GET", parts.path + "events")
    answer, found = line.getresponse(), []
    while not {"state", "faults", "beat"} <= {kind for kind, _ in found}:
        kind = answer.readline().decode().removeprefix("event: ").strip()
        found.append((kind, json.loads(answer.readline().decode().removeprefix("data: "))))
        answer.readline()
    line.close()
    return found


def hear_until(page, holds):
    """Return the state of a trial once it holds; what a page hears first may be a while old."""
    end_s = time.monotonic() + STARTS_S
    while not holds(state := dict(hear(page))["state"]) and time.monotonic() < end_s:
        time.sleep(0.1)
    return state


@pytest.mark.slow
def test_only_who_knows_the_secret_may_look(page):
    """Neither without it, nor with a part of it, nor with another."""
    token = urlsplit(page.url).path.strip("/")
    paths = [
        "/",
        "/events",
        f"/{token[:-1]}/",
        f"/x{token}/",
        "/minute/0",
        f"//{token}/",
        "/%C3%A9",
        "foo",
        "*",
        f"x/{token}/",
    ]
    codes = [ask(page, path, whole=True).status for path in paths]
    assert set(codes) == {403}
    assert ask(page).status == 200
    assert ask(page, f"/{token}", whole=True).getheader("location") == f"/{token}/"


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:8642", "127.0.0.1.evil.example", "", "[::2]:80", "127.0.0.1:x"],
)
def test_a_name_that_is_not_of_this_computer_is_refused(page, host):
    """As a browser sends it that was led here by deceit."""
    assert ask(page, host=host).status in {400, 403}


@pytest.mark.slow
@pytest.mark.parametrize("host", ["localhost:1", "LOCALHOST", "127.0.0.1", "[::1]:8642", "[::1]"])
def test_a_tunnel_may_have_another_port(page, host):
    """The name counts."""
    assert ask(page, host=host).status == 200


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "HEAD", "OPTIONS", "PATCH"])
def test_nothing_but_get_is_answered(page, method):
    """It says what is."""
    answer = ask(page, method=method)
    assert (answer.status, answer.getheader("allow")) == (405, "GET")


@pytest.mark.parametrize("path", ["", "main.js", "minute/0", "minute/7", "nothing"])
def test_every_answer_forbids_what_the_page_does_not_need(page, path):
    """Nothing from elsewhere, no frame, no guess at a type, no copy kept."""
    answer = ask(page, path)
    policy = answer.getheader("content-security-policy").split("; ")
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert not any("unsafe" in part or "http" in part for part in policy)
    assert answer.getheader("x-content-type-options") == "nosniff"
    assert answer.getheader("cache-control") == "no-store"
    assert answer.getheader("referrer-policy") == "no-referrer"


def test_files_of_the_page_alone_are_answered(page):
    """Not those of the trial, nor what lies above."""
    for name in ("main.js", "view.css", "colours.css", "icon.svg", "index.html"):
        assert ask(page, name).status == 200, name
    for name in (
        "../process.py",
        "..%2fprocess.py",
        "%2e%2e/guard.py",
        "trial.toml",
        "__init__.py",
    ):
        assert ask(page, name).status == 404, name
    assert "--zone-0:" in ask(page, "colours.css").text


def test_a_minute_is_answered_and_one_that_is_not_there_says_so(page):
    """Without the path of the trial."""
    assert json.loads(ask(page, "minute/60").text)["start_s"] == 60
    answer = ask(page, "minute/600")
    assert answer.status == 404
    assert json.loads(answer.text) == {"problem": "There is no such minute."}


@pytest.mark.parametrize("start", ["300", "7", "060", "-1", "9" * 5000, "x"])
def test_a_minute_that_the_trial_has_not_is_none(page, start):
    """Whatever stands in its place; it is no error of the server."""
    assert ask(page, f"minute/{start}").status == 404


def test_a_page_hears_the_trial_its_state_and_what_the_watch_tells(page):
    """In the first second; what the watch said before as well."""
    hear(page)
    page.tell({"status": {"stages": {}, "lag_s": 3.0}})
    page.tell({"event": {"event": "failed", "problem": "x"}})
    time.sleep(0.5)
    told = dict(hear(page))
    assert told["trial"]["fish"] == 3
    assert told["state"]["minutes"] == [0, 60, 120]
    assert told["watch"]["lag_s"] == 3.0
    assert told["events"] == [{"event": "failed", "problem": "x"}]
    assert told["beat"] == {"fresh": False}


@pytest.mark.slow
def test_an_open_page_hears_the_end_within_a_second(own_page):
    """And the process is gone; on a busy computer the connection ends without a word."""
    hear(own_page)
    parts = urlsplit(own_page.url)
    line = http.client.HTTPConnection(parts.hostname, parts.port, timeout=STARTS_S)
    line.request("GET", parts.path + "events")
    answer = line.getresponse()
    assert answer.readline() == b"event: trial\n"
    began_s = time.monotonic()
    own_page.close()
    assert time.monotonic() - began_s < 1.0
    with contextlib.suppress(http.client.HTTPException, OSError):
        answer.read()
    assert not own_page.is_alive


def test_all_pages_are_told_of_the_end(kept):
    """As their last event; then their streams are over."""
    trial = read_trial(kept)
    station = Station(trial, load_arena(trial.arena, kept))

    async def listen():
        return [text.split("\n")[0] async for text in station.stream()]

    async def both():
        looking = asyncio.create_task(station.run())
        pages = [asyncio.create_task(listen()) for _ in range(2)]
        await asyncio.sleep(0.3)
        station.close()
        heard = await asyncio.gather(*pages)
        await looking
        return heard

    for heard in asyncio.run(both()):
        assert heard[0] == "event: trial"
        assert heard[-1] == "event: bye"
        assert heard.count("event: bye") == 1


def test_a_page_hears_a_beat_while_a_look_takes_long(kept, monkeypatch):
    """As the first one at a trial of hours does."""
    trial = read_trial(kept)
    station = Station(trial, load_arena(trial.arena, kept))
    is_over = threading.Event()
    monkeypatch.setattr(station._state, "look", lambda: is_over.wait(5) and {})

    async def listen():
        looking = asyncio.create_task(station.run())
        kinds = []
        async for text in station.stream():
            kinds.append(text.split("\n")[0])
            if kinds[-1] in {"event: beat", "event: state"}:
                is_over.set()
                station.close()
        await looking
        return kinds

    kinds = asyncio.run(listen())
    assert "event: beat" in kinds
    assert "event: state" not in kinds[: kinds.index("event: beat")]


def test_for_a_page_that_does_not_read_the_newest_waits(kept):
    """Of each kind one, whatever comes; then the end."""
    trial = read_trial(kept)
    station = Station(trial, load_arena(trial.arena, kept))

    async def listen():
        stream = station.stream()
        await anext(stream)
        for n in range(1000):
            station.hear({"status": {"n": n}})
            station.hear({"event": {"n": n}})
        station.close()
        return [text async for text in stream]

    heard = asyncio.run(listen())
    assert [text.split("\n")[0] for text in heard] == [
        "event: watch",
        "event: events",
        "event: bye",
    ]
    assert '{"n":999}' in heard[0]
    assert '{"n":999}]' in heard[1]


def test_a_number_that_is_none_is_null(kept):
    """In what the watch tells, at any depth."""
    trial = read_trial(kept)
    station = Station(trial, load_arena(trial.arena, kept))
    station.hear({"status": {"lag_s": math.nan, "rows": [{"s": math.inf}, 1.5]}})

    async def second():
        stream = station.stream()
        await anext(stream)
        return await anext(stream)

    text = asyncio.run(second())
    assert text == 'event: watch\ndata: {"lag_s":null,"rows":[{"s":null},1.5]}\n\n'


@pytest.mark.slow
def test_a_page_goes_with_the_process_that_shows_it(trial):
    """Also when that is killed."""
    script = (
        "import sys; from pathlib import Path; from zfcal.view.process import Page\n"
        "if __name__ == '__main__':\n"
        "    page = Page(Path(sys.argv[1]), 0); print(page.url, flush=True); page.wait()\n"
    )
    place = trial / "script.py"
    place.write_text(script)
    words = [sys.executable, place, trial]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        url = urlsplit(process.stdout.readline().strip())
        line = http.client.HTTPConnection(url.hostname, url.port, timeout=STARTS_S)
        line.request("GET", url.path)
        assert line.getresponse().status == 200
        process.send_signal(signal.SIGKILL)
    ends_s = time.monotonic() + 10
    while time.monotonic() < ends_s:
        with socket.socket() as probe:
            if probe.connect_ex((url.hostname, url.port)):
                return
        time.sleep(0.05)
    pytest.fail("it is still there")


def test_a_port_in_use_is_one_clear_error(page, kept):
    """It says which, and what to do."""
    port = urlsplit(page.url).port
    with pytest.raises(
        InputError, match=rf"--view-port: port {port} of 127\.0\.0\.1 is in use"
    ) as said:
        Page(kept, port)
    assert "--view-port" not in said.value.hint
    assert "another port" in said.value.hint


def test_the_secret_stays_while_nobody_else_can_read_it(trial):
    """A file of mode 0600; one that others can read, or that is no secret, is made anew."""
    from zfcal.view.token import TOKEN_NAME, token_of

    token, path = token_of(trial), trial / TOKEN_NAME
    assert len(token) == 24
    assert path.stat().st_mode & 0o777 == 0o600
    assert token_of(trial) == token
    path.chmod(0o644)
    fresh = token_of(trial)
    assert fresh != token
    assert path.stat().st_mode & 0o777 == 0o600
    path.write_text("short")
    assert len(token_of(trial)) == 24
    path.unlink()
    path.symlink_to(trial / "trial.toml")
    assert len(token_of(trial)) == 24
    assert not path.is_symlink()
    assert token_of(trial / "not" / "there") != token_of(trial / "not" / "there")


def test_a_secret_that_cannot_be_written_whole_is_not_kept(trial):
    """As on a disk that is full: there is one for this time, and no half one."""
    from zfcal.view.token import TOKEN_NAME, token_of

    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (5, limits[1]))
    try:
        token = token_of(trial)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert len(token) == 24
    assert not (trial / TOKEN_NAME).exists()


@pytest.mark.slow
def test_a_page_stands_whatever_becomes_of_the_trial(own_page, trial, tmp_path):
    """Gone and back, a folder in a file's place, a model that is none."""
    hear(own_page)
    trial.rename(tmp_path / "away")
    assert dict(hear(own_page))["trial"]["fish"] == 3
    assert hear_until(own_page, lambda state: state["gone"])["gone"] is True
    (tmp_path / "away").rename(trial)
    (trial / "models" / "000240.toml").mkdir()
    (trial / "scores" / "000240.parquet").mkdir()
    (trial / "models" / "000300.toml").write_bytes(os.urandom(100))
    state = hear_until(own_page, lambda state: len(state["problems"]) == 3)
    assert state["gone"] is False
    assert len(state["problems"]) == 3
    assert own_page.is_alive
