"""The line to one gun: a thread of its own that reads, keeps the gun's watchdog quiet, and connects again.

Anyone may `ask` from any thread: every command has a deadline and an outcome, and none is ever repeated here.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from device.serial_gun.clocks import Clocks, Exchange, HostTime
from device.serial_gun.outcomes import OUTCOMES, Command, Disconnected, Refused, TimedOut, WrongVersion
from device.serial_gun.port import OpenPort, Port, SerialPort
from device.wire import errors
from device.wire.frame import Frame, Garbled, Splitter, decode, encode, following
from device.wire.records import WIRE_VERSION, Named, refusal, value
from device.words import LinkError

PATIENCE_S = 0.25
"""For an answer that the gun gives at once. All times here are of the real world, however fast a twin lives."""
WATCHDOG_S = 1.0
KEEP_ALIVE_S = 0.25
RECONNECT_EVERY_S = 0.1
GREETING_TRIES = 5
FIRST_EXCHANGES = 8
SILENT_S = 2.0
"""After so long without a word from the gun the line is closed and opened again."""
MAX_WATCHDOG_MS, MIN_WATCHDOG_MS = 60_000, 100
KEPT_COMMANDS = 10_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """An answer, and when its command was written and it was read, on the host's clock."""

    body: str
    written_s: float
    received_s: float


@dataclass(slots=True, kw_only=True)
class _Waiting:
    """A command whose answer is awaited."""

    body: str
    written_s: float
    since_s: float
    ended: threading.Event = field(default_factory=threading.Event)
    reply: Reply | None = None
    trouble: LinkError | None = None


class Link:
    """The line to the gun at the address that `find` gives each time it connects; `clock` is the host's."""

    def __init__(
        self, find: Callable[[], str], clock: Callable[[], float], speed: float = 1.0, open_port: OpenPort = SerialPort
    ) -> None:
        self.named: Named | None = None
        self.session = 0  # counts the greetings; each disarms the gun
        self.remembers = False  # whether the gun at this greeting still knew the one before
        self.commands: deque[Command] = deque(maxlen=KEPT_COMMANDS)
        self._find, self._clock, self._open_port = find, clock, open_port
        self._watchdog_ms = round(min(max(1000 * WATCHDOG_S * speed, MIN_WATCHDOG_MS), MAX_WATCHDOG_MS))
        self.watchdog_s = self._watchdog_ms / 1000 / speed
        self._keep_alive_s = min(KEEP_ALIVE_S, self.watchdog_s / 4)
        self._clocks = Clocks()
        self._lock = threading.RLock()
        self._port: Port | None = None
        self._splitter = Splitter()
        self._waiting: dict[int, _Waiting] = {}
        self._number = int(time.monotonic() * 1e3) % 0xFFFF
        self._token = 0
        self._written_s = self._heard_s = self._sampled_s = 0.0
        self._trouble: LinkError | None = None
        self._broken, self._unbroken = False, True
        self._plain = b""
        self._up, self._closing = threading.Event(), threading.Event()
        self._failed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="gun", daemon=True)

    def start(self, patience_s: float) -> None:
        """Connect for the first time. `LinkError`: there is no port, no gun, or one of another version."""
        self._thread.start()
        end_s = time.monotonic() + patience_s
        while not self._up.wait(0.005):
            if self._failed.is_set() or time.monotonic() > end_s:
                trouble = self._trouble or TimedOut(f"the gun did not answer within {patience_s:g} s")
                self.close()
                raise trouble

    @property
    def is_up(self) -> bool:
        """Whether the gun is there, in a session of the strict mode."""
        return self._up.is_set()

    @property
    def silent_for_s(self) -> float:
        """How long nothing was written, in seconds of the real world."""
        return time.monotonic() - self._written_s

    def wait_up(self, patience_s: float) -> None:
        """Wait until the gun is there. `Disconnected`: it does not come back."""
        if not self._up.wait(patience_s):
            raise Disconnected(f"the gun is not there ({self._trouble or 'no answer'})")

    def host(self, *gun_us: int) -> list[HostTime]:
        """Times on the gun's clock, on the host's, all by one map. `Disconnected`: the gun with this clock is gone."""
        with self._lock:
            self._check_clocks()
            return [self._clocks.host(time_us) for time_us in gun_us]

    def gun_us(self, host_s: float) -> int:
        """A time on the host's clock, on the gun's. `Disconnected` as `host`."""
        with self._lock:
            self._check_clocks()
            return self._clocks.gun_us(host_s)

    def _check_clocks(self) -> None:
        if not self._clocks.known:
            raise Disconnected("the gun was reset, and its new clock is not known yet")

    @property
    def drift_ppm(self) -> float:
        """How much faster the host's clock runs than the gun's, in millionths."""
        with self._lock:
            return self._clocks.drift_ppm

    def ask(self, body: str, patience_s: float = PATIENCE_S) -> Reply:
        """Write a command and wait for its answer. `LinkError`: its other outcomes, by their type."""
        if not self._up.is_set():
            raise Disconnected(f"the gun is not there ({self._trouble or 'no answer'})")
        number, waiting = self._write(body)
        waiting.ended.wait(patience_s)
        return self._ended(number, waiting)

    def drop(self, why: str) -> None:
        """Let go of the line; the thread connects again, and that disarms the gun."""
        self._lose(Disconnected(why))

    def close(self) -> None:
        """Let go for good."""
        self._closing.set()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join()
        self._lose(Disconnected("the line is closed"))

    def _run(self) -> None:
        while not self._closing.is_set():
            try:
                self._connect()
                while not self._closing.is_set():
                    self._pump()
                    self._keep_alive()
            except LinkError as error:
                self._lose(error)
                fatal = isinstance(error, WrongVersion) or self._port is None
                self._let_go()
                if self.session == 0 and fatal:
                    self._failed.set()
            self._closing.wait(RECONNECT_EVERY_S)
        self._let_go()

    def _connect(self) -> None:
        port = self._open_port(self._find())
        with self._lock:
            self._port, self._splitter, self._broken = port, Splitter(), False
            self._heard_s = time.monotonic()
        self._introduce(port)
        token = self._token + 1 if self._token else int(time.time() * 1e3) % 2**32 + 1
        before = value(self._greet(f"SYST:STRI {token}").body, "STRI")
        same = self._token != 0 and before == self._token
        self._unbroken = self._unbroken and same  # a greeting that broke off may have met a gun that was reset
        named = Named.parse(self._greet("*IDN?").body)
        self._check(named)
        self._greet(f"SYST:WATC {self._watchdog_ms}")
        with self._lock:
            self._token = token
            if not same:
                self._clocks = Clocks()
        for _ in range(FIRST_EXCHANGES):
            self._greet("TIME?")
        self.named, self.remembers, self._unbroken = named, self._unbroken, True
        self.session += 1
        self._up.set()

    def _introduce(self, port: Port) -> None:
        """See who is there, in the plain language that every version speaks; a wrong version must say so twice."""
        said = list[bytes]()
        for _ in range(GREETING_TRIES):
            self._plain = b""
            port.write(b"\n*IDN?\n")
            end_s = time.monotonic() + PATIENCE_S
            while not self._plain and time.monotonic() < end_s and not self._closing.is_set():
                self._pump()
            try:
                self._check(Named.parse(self._plain.decode("latin-1")))
            except (Garbled, WrongVersion):
                said.append(self._plain)
                if len(said) > 1 and said[-1] == said[-2] != b"":
                    raise
                continue
            return
        raise TimedOut("nobody there says that it is a gun")

    def _check(self, named: Named) -> None:
        if named.wire != WIRE_VERSION:
            raise WrongVersion(
                f"{named.model} {named.serial} (firmware {named.firmware}) speaks version {named.wire} of the wire, "
                f"this Recoil version {WIRE_VERSION}; flash the firmware of this Recoil (device/firmware)"
            )
        if self.named is not None and named.serial != self.named.serial:
            raise LinkError(f"another gun is there now: {named.serial}, not {self.named.serial}")

    def _greet(self, body: str) -> Reply:
        """Ask from the thread that reads. What is asked here may be asked again."""
        trouble: LinkError | None = None
        for _ in range(GREETING_TRIES):
            number, waiting = self._write(body)
            end_s = time.monotonic() + PATIENCE_S
            while not waiting.ended.is_set() and time.monotonic() < end_s and not self._closing.is_set():
                self._pump()
            try:
                return self._ended(number, waiting)
            except (TimedOut, Garbled) as error:
                trouble = error
        raise trouble or TimedOut("no answer")

    def _write(self, body: str) -> tuple[int, _Waiting]:
        with self._lock:
            if self._port is None or self._broken:
                raise Disconnected(f"the gun is not there ({self._trouble or 'no answer'})")
            self._number = number = following(self._number)
            now_s = time.monotonic()
            waiting = self._waiting[number] = _Waiting(body=body, written_s=self._clock(), since_s=now_s)
            try:
                self._port.write(encode(Frame(number=number, body=body), "host"))
            except LinkError as error:
                self._waiting.pop(number)
                self._lose(error)
                raise
            self._written_s = time.monotonic()
        return number, waiting

    def _ended(self, number: int, waiting: _Waiting) -> Reply:
        """The answer, or the trouble; either way the command is over and in the log."""
        with self._lock:
            self._waiting.pop(number, None)
        reply, trouble = waiting.reply, waiting.trouble
        if reply is None and trouble is None:
            trouble = TimedOut(f"no answer to {waiting.body.split()[0]} within its time")
        no = refusal(reply.body) if reply else None
        if no is not None:
            trouble = Refused(no.code, f"the gun refused {waiting.body.split()[0]}: {no.reason}")
        self.commands.append(
            Command(
                number=number,
                body=waiting.body,
                written_s=waiting.written_s,
                ended_s=reply.received_s if reply else self._clock(),
                outcome=OUTCOMES.get(type(trouble), "disconnected") if trouble else "done",
            )
        )
        if trouble is not None:
            raise trouble
        if reply is None:  # for the type checker: one of the two is there
            raise TimedOut("no answer")
        return reply

    def _pump(self) -> None:
        """Read what is there, and hand the answers out."""
        port = self._port
        if port is None or self._broken:
            raise Disconnected(str(self._trouble or "the line is gone"))
        data = port.read()
        received_s = self._clock()
        for line in self._splitter.feed(data):
            self._heard_s = time.monotonic()
            self._take(line, received_s)

    def _take(self, line: bytes | None, received_s: float) -> None:
        if line is not None and line[:1] not in {b"<", b""}:
            self._plain = line
        try:
            frame = decode(line or b"", "gun")
        except Garbled as error:
            self._end_all(Garbled(f"the answer was garbled: {error}"))
            return
        if frame.body == "NAK":
            self._end_all(Garbled("the gun understood no line"))
            return
        with self._lock:
            waiting = self._waiting.pop(frame.number, None)
        if frame.body == f"ERR {errors.message(errors.NO_SESSION)}":
            raise Disconnected("the gun has forgotten this session: it was reset, or left alone for too long")
        if waiting is None:  # its deadline has passed
            return
        waiting.reply = Reply(body=frame.body, written_s=waiting.written_s, received_s=received_s)
        self._learn(waiting, waiting.reply)
        waiting.ended.set()

    def _learn(self, waiting: _Waiting, reply: Reply) -> None:
        if waiting.body != "TIME?" or not reply.body.startswith("TIME "):
            return
        exchange = Exchange(sent_s=reply.written_s, gun_us=value(reply.body, "TIME"), received_s=reply.received_s)
        with self._lock:
            self._clocks.add(exchange)

    def _end_all(self, trouble: LinkError) -> None:
        with self._lock:
            ended = [self._waiting.pop(number) for number in list(self._waiting)]
        for waiting in ended:
            waiting.trouble = trouble
            waiting.ended.set()

    def _keep_alive(self) -> None:
        """Ask for the time now and then; nobody waits for it, but the clocks learn from it."""
        now_s = time.monotonic()
        if now_s - self._heard_s > max(SILENT_S, 2 * self.watchdog_s):
            raise Disconnected("the gun says nothing any more")
        with self._lock:
            for number, waiting in list(self._waiting.items()):
                if waiting.body == "TIME?" and now_s - waiting.since_s > SILENT_S:
                    self._waiting.pop(number)
        if now_s - self._sampled_s >= self._keep_alive_s:
            self._sampled_s = now_s
            self._write("TIME?")

    def _lose(self, trouble: LinkError) -> None:
        """The line is of no use any more: whoever waits is told. The thread that reads lets go of the port."""
        self._up.clear()
        self._trouble, self._broken = trouble, True
        self._end_all(Disconnected(str(trouble)))

    def _let_go(self) -> None:
        with self._lock:
            port, self._port = self._port, None
        if port is not None:
            port.close()
