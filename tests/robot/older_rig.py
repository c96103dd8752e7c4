"""The settings port of the older software as it is in its source: for tests of what talks to it."""

import threading

import zmq


class Rig:
    """Binds two neighbouring ports, takes what is set and answers what is asked.

    Parameters
    ----------
    settings : dict
        Its settings file: numbers by path. Others are unknown to it: they answer 0.
    port
        Of an earlier one that has gone; None for a free one.
    deaf : set of str
        Paths that it knows but does not take.
    """

    def __init__(self, settings, *, port=None, deaf=frozenset()):
        self.settings, self.deaf, self.heard = dict(settings), deaf, []
        self._context = zmq.Context()
        self._hears = self._context.socket(zmq.SUB)
        self._speaks = self._context.socket(zmq.PUB)
        self._hears.subscribe("")
        self.port = self._bind(port)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _bind(self, port):
        for wanted in [port] if port else range(20557, 30000, 2):
            try:
                self._hears.bind(f"tcp://127.0.0.1:{wanted}")
                self._speaks.bind(f"tcp://127.0.0.1:{wanted + 1}")
            except zmq.ZMQError:
                continue
            return wanted
        raise AssertionError("no two ports are free")

    def _serve(self):
        while not self._ends.is_set():
            if not self._hears.poll(20):
                continue
            frames = [part.decode() for part in self._hears.recv_multipart()]
            self.heard.append(frames)
            whom, path, command, data = frames
            assert whom == "cats"
            if command == "set" and path in self.settings and path not in self.deaf:
                self.settings[path] = [float(value) for value in data.split(";")]
            if command == "get":
                # Six digits, as QString::number has.
                values = ";".join(f"{value:.6g}" for value in self.settings.get(path, [0.0]))
                answer = ("optimiser", path, "set", values)
                self._speaks.send_multipart([part.encode() for part in answer])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._ends.set()
        self._thread.join()
        self._context.destroy(linger=0)
