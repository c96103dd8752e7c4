"""The settings port of the older tracking software (CATS2), which takes a model's parameters.

Its messages are four frames of text over ZeroMQ: whom they are for, a path of its settings
file, ``set`` or ``get``, and numbers with semicolons between them. The rig binds both
sockets: it hears on a port (5557) and answers on the next one. A message that is sent while
nobody is connected is lost, and nothing is acknowledged; so what was set is asked for, and
sent again until the rig says so itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Self, TypeAlias, final
from urllib.parse import urlsplit

from zfcal.errors import InputError
from zfcal.parameters import Parameters, ZoneParameters

if TYPE_CHECKING:
    import zmq

Settings: TypeAlias = Mapping[str, tuple[float, ...]]

_PORT = 5557
DT = "robots/fishModel/simulation/dt"
_ZONE = "robots/fishModel/ZonedBM/zone_{number}/{name}"
_RIG = "cats"

_RETRY_S = 0.25
"""What the rig has not confirmed is sent again so often."""

_PATIENCE_S = 10.0
"""After so long without confirmation that is said; what is confirmed is asked for so often."""

_DIGITS = 2e-5
"""The rig answers with six digits, and keeps some of its settings in single precision."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Address:
    """Where a rig listens; it answers on the port after that.

    Parameters
    ----------
    host
        Its name or address.
    port
        1 to 65534.
    """

    host: str
    port: int = _PORT

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the address that ``cats2://host[:port]`` states.

        Raises
        ------
        InputError
            It is no such address.
        """
        hint = f"Such as cats2://rig or cats2://10.0.0.5:{_PORT}."
        try:
            parts = urlsplit(text)
            host, port = parts.hostname, parts.port or _PORT
        except ValueError as error:
            raise InputError(f"{text!r} is no address of a rig: {error}.", hint=hint) from error
        if parts.scheme != "cats2" or not host or parts.path.strip("/") or not port < 65535:
            raise InputError(f"{text!r} is no address of a rig.", hint=hint)
        return cls(host=host, port=port)

    def __str__(self) -> str:
        return f"cats2://{self._named}:{self.port}"

    @property
    def _named(self) -> str:
        return f"[{self.host}]" if ":" in self.host else self.host

    def tcp(self, *, answers: bool) -> str:
        """Return the address of one of the two sockets, as ZeroMQ writes it."""
        return f"tcp://{self._named}:{self.port + answers}"


def settings_of(model: Parameters, zones: tuple[str, ...]) -> Settings:
    """Return a model as settings of a rig.

    Parameters
    ----------
    model
        Effects have no settings and are left out.
    zones
        For each zone of the rig, from ``zone_1`` on, the zone of the model whose
        parameters it gets; several may get the same.

    Returns
    -------
    mapping
        Numbers by path.

    Raises
    ------
    InputError
        The model has no such zone.
    """
    known = {zone.name: zone for zone in model.zones}
    unknown = [name for name in zones if name not in known]
    if unknown or not zones:
        raise InputError(
            f"The model has no zone {', '.join(unknown) or '(none given)'}, only "
            f"{', '.join(known)}.",
            hint="Give one of these for each zone of the rig, in the order of its settings file.",
        )
    found: dict[str, tuple[float, ...]] = {}
    for number, name in enumerate(zones, start=1):
        for key, values in _zone_settings(known[name], zones).items():
            found[_ZONE.format(number=number, name=key)] = values
    return MappingProxyType(found)


def _zone_settings(zone: ZoneParameters, zones: tuple[str, ...]) -> dict[str, tuple[float, ...]]:
    return {
        "kappaNeutCenter": (zone.kappa_0,),
        "kappaFishes": (zone.kappa_f,),
        "alphasCenter": (zone.alpha,),
        "kappaWalls": (zone.kappa_0 if zone.kappa_w is None else zone.kappa_w,),
        "zonesAffinity": tuple(zone.gamma[to] for to in zones),
        "speedHistogram": zone.speed_frequency,
    }


def request(path: str, values: tuple[float, ...] | None = None) -> list[bytes]:
    """Return the frames that set a value; without one those that ask for it."""
    data = "" if values is None else ";".join(f"{value:.9g}" for value in values)
    return [part.encode() for part in (_RIG, path, "get" if values is None else "set", data)]


def understand(frames: list[bytes]) -> tuple[str, tuple[float, ...]] | None:
    """Return path and values that a rig states; None for anything else."""
    if len(frames) != 4 or frames[2] != b"set":
        return None
    try:
        path, data = frames[1].decode(), frames[3].decode()
        return path, tuple(float(value) for value in data.split(";") if value.strip())
    except ValueError:
        return None


@final
class OlderRig:
    """A connection to a rig, and what it has been told.

    Parameters
    ----------
    address
        Where it listens; it need not be there yet.
    zones
        See `settings_of`.

    Raises
    ------
    InputError
        The package pyzmq is missing, or there can be no such address.

    Attributes
    ----------
    missing
        Paths that the rig has not confirmed yet.
    """

    def __init__(self, address: Address, zones: tuple[str, ...]) -> None:
        try:
            import zmq
        except ImportError as error:
            raise InputError(
                f"{address}: this needs the package pyzmq, which cannot be loaded ({error}).",
                hint="Install it with: pip install 'zfcal[cats]'",
            ) from error
        self.address, self._zones = address, zones
        self._nothing: type[Exception] = zmq.Again
        self._context = zmq.Context()
        self._speaks = self._socket(zmq.PUB, answers=False)
        self._hears = self._socket(zmq.SUB, answers=True)
        self._hears.subscribe("")
        self._wanted: Settings = {}
        self._said: dict[str, tuple[float, ...]] = {}
        self._dt_s = math.nan
        self._offered_s = self._asked_s = -math.inf
        self._news: set[str] = set()
        self.missing: set[str] = set()

    def _socket(self, kind: int, *, answers: bool) -> zmq.Socket[bytes]:
        import zmq

        made: zmq.Socket[bytes] = self._context.socket(kind)
        # Leaving waits this long for what is still under way, no longer.
        made.linger = 200
        try:
            made.connect(self.address.tcp(answers=answers))
        except zmq.ZMQError as error:
            self._context.destroy(linger=0)
            raise InputError(f"{self.address}: cannot be connected to ({error}).") from error
        return made

    def offer(self, model: Parameters, now_s: float) -> None:
        """Take a model that the rig is to swim by from now on.

        Raises
        ------
        InputError
            The model lacks a zone that the rig is to have.
        """
        self._wanted, self._dt_s = settings_of(model, self._zones), model.dt_s
        self.missing, self._said, self._news = set(self._wanted), {}, set()
        self._offered_s, self._asked_s = now_s, -math.inf

    def look(self, now_s: float) -> list[str]:
        """Hear what the rig says and send what it has not; never wait.

        Parameters
        ----------
        now_s
            Seconds by a clock that nobody sets.

        Returns
        -------
        list of str
            What is worth telling: each thing once for a model.
        """
        if not self._wanted:
            return []
        self._hear()
        late = bool(self.missing) and now_s - self._offered_s > _PATIENCE_S
        pause_s = _RETRY_S if self.missing and not late else _PATIENCE_S
        if now_s - self._asked_s >= pause_s:
            self._asked_s = now_s
            self._send()
        return [text for text in self._texts(late=late) if self._is_new(text)]

    def close(self) -> None:
        """Leave."""
        self._context.destroy(linger=200)

    def _hear(self) -> None:
        import zmq

        while True:
            try:
                said = understand(self._hears.recv_multipart(zmq.NOBLOCK))
            except self._nothing:
                return
            if said is None:
                continue
            path, values = said
            self._said[path] = values
            if path in self._wanted:
                # A rig that was started anew has forgotten: then it is missing again.
                is_there = _alike(values, self._wanted[path])
                (self.missing.discard if is_there else self.missing.add)(path)

    def _send(self) -> None:
        for path, values in self._wanted.items():
            if path in self.missing:
                self._speaks.send_multipart(request(path, values))
            self._speaks.send_multipart(request(path))
        self._speaks.send_multipart(request(DT))

    def _texts(self, *, late: bool) -> list[str]:
        found = []
        if not self.missing:
            found.append(f"{self.address} has taken {len(self._wanted)} settings.")
        elif late and not self._said:
            found.append(f"{self.address} does not answer; the request is repeated.")
        elif late:
            path = min(self.missing)
            says = ";".join(f"{value:g}" for value in self._said.get(path, ())) or "nothing"
            found.append(
                f"{self.address} has not taken {len(self.missing)} of {len(self._wanted)} "
                f"settings, such as {path}: it says {says}."
            )
        (dt_s,) = self._said.get(DT, (0.0,))[:1] or (0.0,)
        # Software that does not know the path answers 0.
        if dt_s and not _alike((dt_s,), (self._dt_s,)):
            found.append(
                f"{self.address} has a step of {dt_s:g} s, the model holds for {self._dt_s:g} s: "
                "speeds and turns will be others."
            )
        return found

    def _is_new(self, text: str) -> bool:
        is_new = text not in self._news
        self._news.add(text)
        return is_new


def _alike(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return len(one) == len(other) and all(
        math.isclose(a, b, rel_tol=_DIGITS, abs_tol=1e-9) for a, b in zip(one, other, strict=True)
    )
