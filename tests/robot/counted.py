"""A port in memory that counts what waits, and two writers to it."""

from zfcal.robot.aseba import Decoder
from zfcal.robot.stop_guard import DRIVER, HELPER, Output, Slate


class CountedPort:
    """A port's driver with so much room: bytes wait in it until `drain` lets them go to a robot.

    One that does not ``reports`` says that nothing waits, as a pseudo-terminal does.
    """

    def __init__(self, *, room=4096, reports=True):
        self.room, self.reports = room, reports
        self.queue, self.arrived = bytearray(), bytearray()
        self.most = 0

    def write(self, data):
        """Take what there is room for."""
        taken = data[: max(0, self.room - len(self.queue))]
        self.queue += taken
        self.most = max(self.most, len(self.queue))
        return len(taken)

    def unsent(self):
        """Say how much waits."""
        return len(self.queue) if self.reports else 0

    def flush(self):
        """Drop it."""
        dropped, self.queue = len(self.queue), bytearray()
        return dropped if self.reports else 0

    def resume(self):
        """Let bytes go, as they always do here."""

    def drain(self, count=10**6):
        """Let so many bytes go."""
        self.arrived += self.queue[:count]
        del self.queue[:count]

    def frames(self):
        """Return what a robot at the other end has understood."""
        return Decoder().feed(bytes(self.arrived))


def writers(port, *, is_lossless=True, clock=lambda: 0.0):
    """Return a slate and the outputs of driver and helper to one port."""
    slate = Slate(bytearray(Slate.SIZE))
    how = {"is_lossless": is_lossless, "clock": clock}
    return slate, *(Output(port, slate, who, **how) for who in (DRIVER, HELPER))
