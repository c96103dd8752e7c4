"""Programs of Debian packages that `.ci/run` installs; tests of the marker `apt` need them."""

import os
import shutil
from pathlib import Path

import pytest

PACKAGES = {
    "chromium": ("chromium", "chromium-browser"),
    "rsync": ("rsync",),
    "iproute2": ("ip",),
    "man-db": ("man",),
    "faketime": ("/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1",),
}
"""What is needed of each package: a program, or a file; the first that is there will do."""

HEADLESS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
"""Options of a Chromium that shows nothing and asks nobody."""


def need(package):
    """Return the path of what is needed of a package.

    Without it a test is skipped; in CI (where ``CI`` is set), which installs it, the test fails.
    """
    for name in PACKAGES[package]:
        found = shutil.which(name) if "/" not in name else name
        if found is not None and Path(found).exists():
            return Path(found)
    lacks = f"needs the Debian package {package}: apt-get install {package}"
    if os.environ.get("CI"):
        pytest.fail(f"{lacks}; CI is to have installed it.", pytrace=False)
    return pytest.skip(lacks)
