"""What there is to say of the computer."""

import os

import pytest

from zfcal.artifacts.machine import cores, file_system, free_bytes, is_network, versions

MOUNTS = r"""22 1 254:1 / / rw,relatime - ext4 /dev/vda rw
30 22 0:27 / /mnt/lab rw - nfs4 server:/lab rw,vers=4.2
31 30 0:28 / /mnt/lab/fast\040disk rw - tmpfs tmpfs rw
32 22 0:29 / /mnt/labour rw shared:1 - fuse.sshfs host:/ rw
33 22 0:30 / /over rw - ext4 /dev/vdb rw
34 33 0:31 / /over rw - cifs //server/share rw
half a line
"""


@pytest.mark.parametrize(
    ("path", "kind"),
    [
        ("/home/fish", "ext4"),
        ("/mnt/lab", "nfs4"),
        ("/mnt/lab/trial/tracks", "nfs4"),
        ("/mnt/lab/fast disk/trial", "tmpfs"),
        ("/mnt/labour/trial", "fuse.sshfs"),
        ("/mnt/labyrinth", "ext4"),
        ("/over/x", "cifs"),
    ],
)
def test_a_path_lies_on_the_innermost_mount(tmp_path, path, kind):
    """Whole folder names count, and of two mounts at one place the later."""
    mounts = tmp_path / "mountinfo"
    mounts.write_text(MOUNTS)

    assert file_system(tmp_path.__class__(path), mounts) == kind


def test_where_nobody_says_the_file_system_is_unknown(tmp_path):
    """Other systems have no such table."""
    assert file_system(tmp_path, tmp_path / "missing") == ""


@pytest.mark.parametrize(
    ("kind", "network"),
    [("nfs4", True), ("cifs", True), ("fuse.sshfs", True), ("9p", True), ("ext4", False),
     ("tmpfs", False), ("", False)],
)  # fmt: skip
def test_network_file_systems_are_known(kind, network):
    """Those on which changes made elsewhere are not announced."""
    assert is_network(kind) is network


def test_versions_name_python_and_what_bears_on_the_numbers():
    """All of them are there."""
    found = versions()

    assert {"python", "zfcal", "numpy", "numba"} <= set(found)
    assert "missing" not in found.values()


def test_cores_are_those_this_process_may_use():
    """At least one, at most what the computer has."""
    assert 1 <= cores() <= (os.cpu_count() or 1)


def test_free_space_is_that_of_the_disk(tmp_path):
    """A positive number of bytes."""
    assert free_bytes(tmp_path) > 0
