"""Take away from zfcal what only some systems have, as far as that can be done on Linux.

What is gone is what Windows lacks, together with what macOS lacks; and as on Windows, a file that
this process has open is neither replaced nor removed, and no folder is opened. Other people's
packages, and the standard library, have a version of their own for each system: they keep what
that for Linux uses.
"""

import builtins
import contextlib
import errno
import os
import signal
import sys
from pathlib import Path
from types import ModuleType

MODULES = """
    crypt curses fcntl grp nis pty pwd readline resource syslog termios tty
"""
"""Modules of the standard library that are not there."""

OS_NAMES = """
    F_LOCK F_TEST F_TLOCK F_ULOCK O_ASYNC O_CLOEXEC O_DIRECT O_DIRECTORY O_DSYNC O_NDELAY
    O_NOATIME O_NOCTTY O_NOFOLLOW O_NONBLOCK O_PATH O_SYNC O_TMPFILE PRIO_PROCESS WNOHANG chown
    chroot confstr copy_file_range ctermid eventfd fchdir fchown fdatasync fork forkpty
    fpathconf fstatvfs getegid geteuid getgid getgrouplist getgroups getloadavg getpgid getpgrp
    getpriority getresgid getresuid getsid getuid getxattr initgroups killpg lchown listxattr
    lockf major makedev memfd_create minor mkfifo mknod nice openpty pathconf pidfd_open pipe2
    posix_fadvise posix_fallocate posix_openpt posix_spawn posix_spawnp pread preadv pwrite
    pwritev readv register_at_fork removexattr sched_getaffinity sched_getparam
    sched_setaffinity sched_yield sendfile set_blocking setegid seteuid setgid setpgid
    setpriority setsid setuid setxattr splice statvfs sync sysconf tcgetpgrp tcsetpgrp ttyname
    uname unshare wait wait3 wait4 waitid writev
"""
"""What is in `os` on Linux and not on Windows or not on macOS."""

SIGNAL_NAMES = """
    SIGALRM SIGCHLD SIGCONT SIGHUP SIGIO SIGKILL SIGPIPE SIGPOLL SIGPWR SIGQUIT SIGSTOP SIGTSTP
    SIGUSR1 SIGUSR2 SIG_BLOCK SIG_SETMASK SIG_UNBLOCK alarm getitimer pause pthread_kill
    pthread_sigmask setitimer siginterrupt sigpending sigtimedwait sigwait sigwaitinfo
"""
"""The same of `signal`."""


class _Elsewhere(ModuleType):
    """A module of which zfcal does not see everything."""

    def __getattribute__(self, name):
        if name in _HIDDEN and _is_ours(sys._getframe(1).f_globals):
            raise AttributeError(f"no {name} on this system")
        return super().__getattribute__(name)


_HIDDEN = frozenset(f"{OS_NAMES} {SIGNAL_NAMES}".split())
_MISSING = frozenset(MODULES.split())
_import = builtins.__import__
_open, _replace, _unlink = os.open, os.replace, os.unlink


def _import_elsewhere(name, globals=None, *rest, **named):  # noqa: A002 - its own name for it
    if name.partition(".")[0] in _MISSING and _is_ours(globals or {}):
        raise ModuleNotFoundError(f"no module {name} on this system", name=name)
    return _import(name, globals, *rest, **named)


def _open_elsewhere(path, *rest, **named):
    if _is_ours(sys._getframe(1).f_globals) and Path(path).is_dir():
        raise PermissionError(errno.EACCES, "a folder", os.fspath(path))
    return _open(path, *rest, **named)


def _replace_elsewhere(source, target, **named):
    _refuse_open(source)
    _refuse_open(target)
    return _replace(source, target, **named)


def _unlink_elsewhere(path, **named):
    if not named:
        _refuse_open(path)
    return _unlink(path, **named)


def _refuse_open(path):
    place = os.path.realpath(path)
    for number in os.listdir("/proc/self/fd"):  # noqa: PTH208 - numbers, not paths
        found = ""
        with contextlib.suppress(OSError):
            found = str(Path(f"/proc/self/fd/{number}").readlink())
        if found == place:
            raise PermissionError(errno.EACCES, "this process has it open", os.fspath(path))


def _is_ours(names):
    return names.get("__name__", "").partition(".")[0] in {"zfcal", "zfcal_cli"}


def go_elsewhere():
    """Take it all away from what this process will import of zfcal."""
    builtins.__import__ = _import_elsewhere
    os.open, os.replace, os.unlink = _open_elsewhere, _replace_elsewhere, _unlink_elsewhere
    os.__class__ = signal.__class__ = _Elsewhere
