"""Three computers: network namespaces that share a trial by rsync, each with its own copy."""

import contextlib
import os
import shutil
import subprocess
import time

import pytest

PORT = 8730
CUT_S = float(os.environ.get("ZFCAL_CUT_S", "3"))
"""So long each link is cut; a minute, as a rig should bear, is too long for every day."""

NAMES = ("tracker", "analyser", "calibrator")
PULLS = {
    "tracker": [("analyser", "stats"), ("analyser", "scores"), ("calibrator", "models")],
    "analyser": [("tracker", "tracks")],
    "calibrator": [("tracker", "tracks"), ("analyser", "stats")],
}
"""What each computer fetches, and from whom; the tracker's is the one that drives the robot."""

PULL = """
while true; do
  {lines}
  sleep 0.2
done
"""
LINE = (
    "rsync -rt --exclude='.*' --contimeout=1 --timeout=1 "
    "rsync://{address}:{port}/trial/{folder}/ {root}/{folder}/ 2>/dev/null"
)


def ip(*words, **options):
    """Run ip(8)."""
    return subprocess.run(["ip", *words], check=True, capture_output=True, text=True, **options)


class Computers:
    """Namespaces on one switch, with an rsync daemon and a fetching loop in each."""

    def __init__(self, place, trial):
        self.prefix = f"zf{os.getpid()}"
        self.roots = {name: place / name / "trial" for name in NAMES}
        self._place = place
        self._processes = []
        for root in self.roots.values():
            shutil.copytree(trial, root)

    def space(self, name):
        """Return the words that run something on a computer."""
        return ["ip", "netns", "exec", f"{self.prefix}-{name}"]

    def address(self, name):
        """Return a computer's address."""
        return f"10.213.87.{1 + NAMES.index(name)}"

    def connect(self):
        """Make the computers, the switch and the links."""
        hub = f"{self.prefix}-hub"
        ip("netns", "add", hub)
        ip("-n", hub, "link", "add", "switch", "type", "bridge")
        ip("-n", hub, "link", "set", "switch", "up")
        for number, name in enumerate(NAMES):
            space = f"{self.prefix}-{name}"
            ip("netns", "add", space)
            ip("-n", hub, "link", "add", f"to{number}", "type", "veth", "peer", "name", "eth0",
               "netns", space)  # fmt: skip
            ip("-n", hub, "link", "set", f"to{number}", "master", "switch", "up")
            ip("-n", space, "address", "add", f"{self.address(name)}/24", "dev", "eth0")
            ip("-n", space, "link", "set", "eth0", "up")
            ip("-n", space, "link", "set", "lo", "up")

    def serve(self):
        """Start the daemons and the fetching loops."""
        for name, root in self.roots.items():
            settings = root.parent / "rsyncd.conf"
            settings.write_text(f"use chroot = no\nuid = root\n[trial]\npath = {root}\n")
            daemon = ["rsync", "--daemon", "--no-detach", f"--port={PORT}", f"--config={settings}"]
            lines = [
                LINE.format(address=self.address(other), port=PORT, folder=folder, root=root)
                for other, folder in PULLS[name]
            ]
            loop = ["sh", "-c", PULL.format(lines="\n  ".join(lines))]
            for words in (daemon, loop):
                self._processes.append(
                    subprocess.Popen([*self.space(name), *words], start_new_session=True)
                )

    @contextlib.contextmanager
    def cut(self, name):
        """Cut a computer off for the length of a block."""
        hub, link = f"{self.prefix}-hub", f"to{NAMES.index(name)}"
        ip("-n", hub, "link", "set", link, "down")
        yield
        ip("-n", hub, "link", "set", link, "up")

    def close(self):
        """End all that was started, and remove the namespaces."""
        for process in self._processes:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, 9)
            process.wait()
        for name in (*NAMES, "hub"):
            subprocess.run(
                ["ip", "netns", "delete", f"{self.prefix}-{name}"], check=False, capture_output=True
            )


@pytest.fixture
def computers(trial, tmp_path, debian):
    """Return three computers with the trial's settings, its segments waiting in a folder."""
    debian.need("rsync")
    debian.need("iproute2")
    shutil.move(trial / "tracks", tmp_path / "waiting")
    made = Computers(tmp_path, trial)
    try:
        made.connect()
    except subprocess.CalledProcessError as error:
        made.close()
        pytest.skip(f"network namespaces cannot be made here: {error.stderr.strip()}")
    made.serve()
    yield made
    made.close()


@pytest.mark.apt
@pytest.mark.slow
def test_three_computers_close_the_loop_and_a_cut_link_heals(
    computers, trial, tmp_path, zfcal, watching
):
    """Each link is cut in turn while segments appear; in the end all have the offline files."""
    waiting = tmp_path / "waiting"
    tracks = computers.roots["tracker"] / "tracks"
    tracks.mkdir()

    def track(start):
        part = tracks / ".part"
        shutil.copy(waiting / f"{start:06d}.parquet", part)
        part.rename(tracks / f"{start:06d}.parquet")

    def start(name, *words):
        root = computers.roots[name]
        return watching.start(root, *words, prefix=computers.space(name))

    with (
        start("analyser", "--stages", "analyse") as analyse,
        start("calibrator", "--stages", "calibrate", *watching.quick) as calibrate,
    ):
        analyse.until("began")
        calibrate.until("began")
        track(0)
        with computers.cut("tracker"):
            track(60)
            time.sleep(CUT_S)
            assert not list((computers.roots["analyser"]).glob("stats/*"))
        analyse.until("made")
        with computers.cut("calibrator"):
            track(120)
            time.sleep(CUT_S)
        calibrate.until("finished", window_end_s=120)
        with computers.cut("analyser"):
            track(180)
            time.sleep(CUT_S)
        assert analyse.wait() == 0
        assert calibrate.wait() == 0
    assert not any("skipped" in event["event"] for event in calibrate.events)
    shutil.copytree(waiting, trial / "tracks")
    assert zfcal("analyse", trial).code == 0
    assert zfcal("calibrate", trial, *watching.quick).code == 0
    expected = watching.contents(trial)
    ours = computers.roots["tracker"]
    ends_s = time.monotonic() + 20
    own = ("-model.parquet", "-rules.parquet")
    made = {name: data for name, data in expected.items() if not name.endswith(own)}
    while watching.contents(ours) != made:
        assert time.monotonic() < ends_s, sorted(watching.contents(ours))
        time.sleep(0.2)
    calibrated = watching.contents(computers.roots["calibrator"])
    for ending in own:
        assert calibrated[f"scores/000180{ending}"] == expected[f"scores/000180{ending}"]
