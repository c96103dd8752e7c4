"""A process that waits until its parent has gone and then tells the robot to stop.

It is run as a file, by itself, and therefore imports nothing but the standard library: it has
to be there within a moment, and to last when the driver is killed.
"""

from __future__ import annotations

import contextlib
import os
import sys

STOP = bytes.fromhex("00 00 00 00 01 00")
"""The frame that `zfcal.robot.events.stop` makes; a test compares them."""


def main() -> None:
    """Wait for the end of standard input, then write STOP to the descriptor that is named."""
    descriptor = int(sys.argv[1])
    while os.read(0, 64):
        pass
    with contextlib.suppress(OSError):
        os.set_blocking(descriptor, False)
        os.write(descriptor, STOP)


if __name__ == "__main__":
    main()
