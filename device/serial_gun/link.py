"""The line to one gun: a thread that reads and connects again, and one that only keeps the gun's watchdog quiet.

Anyone may `ask` from any thread: every command has a deadline and an outcome, and none is ever repeated here.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress

from device.machine_clock import machine_s
from device.serial_gun import lines
from device.wire.errors import WireError, message
from device.wire.records import WIRE_VERSION, Frame, Garbled, Named, Splitter, decode, encode, following, named_value
from device.words import LinkError

PATIENCE_S = 0.25
"""For an answer that the gun gives at once. All times here are of the real world, however fast a twin lives."""
WATCHDOG_S = 0.38
"""After so long without a frame the gun disarms itself: 0.4 s after its host died, less 20 ms for what was still on the
way (a frame takes 1 ms at 460,800 baud, and a USB adapter keeps back only what comes from the gun)."""
KEEP_ALIVE_S = 0.06
"""Six in a watchdog's time: this machine may be away for 0.3 s, and a bad line may lose five in a row."""
RECONNECT_EVERY_S = 0.1
GREETING_TRIES = 5
FIRST_EXCHANGES = 8
SILENT_S = 2.0
"""After so long without a word from the gun the line is closed and opened again."""
_MAX_WATCHDOG_MS, _MIN_WATCHDOG_MS = 60_000, 100
PLAIN_NAME = b"Recoil,"
"""How a gun's name begins in its plain language."""
_NO_SESSION = f"ERR {message(WireError.NO_SESSION)}"


class Link:
    """The line to the gun at the address that `find` gives each time it connects; `clock` is the host's."""

    def __init__(
        self,
        find: Callable[[], str],
        clock: Callable[[], float],
        speed: float = 1.0,
        open_port: lines.OpenPort = lines.SerialPort,
    ) -> None:
        self.named: Named | None = None
        self.session = 0  # counts the greetings; each disarms the gun
        self.boot = 0  # counts the greetings of a gun that did not know the one before: its clock and count are new
        self.remembers = False  # whether the gun at this greeting still knew the one before
        self.why_lost = ""  # what ended the session before this one
        self._find, self._clock, self._open_port = find, clock, open_port
        self._watchdog_ms = round(min(max(1000 * WATCHDOG_S * speed, _MIN_WATCHDOG_MS), _MAX_WATCHDOG_MS))
        self.watchdog_s = self._watchdog_ms / 1000 / speed
        self._keep_alive_s = min(KEEP_ALIVE_S, self.watchdog_s / 6)
        self._clocks = lines.Clocks()
        self.lock = threading.RLock()
        self._port: lines.Port | None = None
        self._splitter = Splitter()
        self._pending = lines.Pending()
        self._number = int(machine_s() * 1e3) % 0xFFFF
        self._token = 0
        self.written_s = self._heard_s = 0.0
        self._trouble: LinkError | None = None
        self._ended_by: LinkError | None = None  # the trouble that ended the last session
        self._broken, self._unbroken, self._leaving = False, True, False
        self._plain = b""
        self._up, self.closing = threading.Event(), threading.Event()
        self._failed = threading.Event()
        self.thread = threading.Thread(target=self._run, name="gun", daemon=True)
        self.keeper = threading.Thread(target=self._keep_alive, name="gun-keep-alive", daemon=True)

    def start(self, patience_s: float) -> None:
        """Connect for the first time. `LinkError`: there is no port, no gun, or one of another version."""
        self.thread.start()
        self.keeper.start()
        end_s = machine_s() + patience_s
        while not self._up.wait(0.005):
            if self._failed.is_set() or machine_s() > end_s:
                trouble = self._trouble or lines.TimedOut(f"the gun did not answer within {patience_s:g} s")
                self.close()
                raise trouble

    @property
    def clock_jumps(self) -> int:
        """How often the gun's clock contradicted what was known of it, in this session."""
        return self._clocks.jumps

    @property
    def silent_for_s(self) -> float:
        """How long nothing was written, in seconds of the real world."""
        return machine_s() - self.written_s

    def wait_up(self, patience_s: float) -> None:
        """Wait until the gun is there. `Disconnected`: it does not come back."""
        if self.closing.is_set() or not self._up.wait(patience_s):
            raise lines.Disconnected(f"the gun is not there ({self._trouble or 'no answer'})")

    def host(self, *gun_us: int) -> list[lines.HostTime]:
        """Times on the gun's clock, on the host's, all by one map. `Disconnected`: the gun with this clock is gone."""
        with self.lock:
            self._check_clocks()
            return [self._clocks.host(time_us) for time_us in gun_us]

    def gun_us(self, host_s: float) -> int:
        """A time on the host's clock, on the gun's. `Disconnected` as `host`."""
        with self.lock:
            self._check_clocks()
            return self._clocks.gun_us(host_s)

    def _check_clocks(self) -> None:
        if not self._clocks.known:
            raise lines.Disconnected("the gun was reset, and its new clock is not known yet")

    def ask(self, body: str, patience_s: float = PATIENCE_S, allowed: Callable[[], bool] = lambda: True) -> lines.Reply:
        """Write a command and wait for its answer. `LinkError`: its other outcomes, by their type.

        `allowed` is asked while nobody else can write: a command that is not allowed then is `CalledOff`.
        """
        with self.lock:
            if not self._up.is_set():
                raise lines.Disconnected(f"the gun is not there ({self._trouble or 'no answer'})")
            if not allowed():
                raise lines.CalledOff(f"{body.split(maxsplit=1)[0]} was called off: the gun was disarmed meanwhile")
            waiting = self._write(body)
        waiting.ended.wait(patience_s)
        return self._pending.outcome(waiting)

    def drop(self, why: str) -> None:
        """Let go of the line; the thread connects again, and that disarms the gun."""
        self._lose(lines.Disconnected(why))

    def close(self) -> None:
        """Leave the gun disarmed in its plain mode, and let go for good."""
        with self.lock:
            self._leaving = True
        with suppress(LinkError):
            self.ask("SYST:PLAI")
        self.closing.set()
        for thread in (self.thread, self.keeper):
            if thread.is_alive():
                thread.join()
        self._lose(lines.Disconnected("the line is closed"))

    def _run(self) -> None:
        while not self.closing.is_set():
            try:
                self._connect()
                while not self.closing.is_set():
                    self._pump()
                    self._look_after()
            except LinkError as error:
                self._lose(error)
                fatal = isinstance(error, lines.WrongVersion) or self._port is None
                self._let_go()
                if self.session == 0 and fatal:
                    self._failed.set()
            self.closing.wait(RECONNECT_EVERY_S)
        self._let_go()

    def _connect(self) -> None:
        port = self._open_port(self._find())
        with self.lock:
            self._port, self._splitter, self._broken = port, Splitter(), False
            self._heard_s = machine_s()
        self._introduce(port)
        token = self._token + 1 if self._token else int(time.time() * 1e3) % 2**32 + 1
        before = named_value(self._greet(f"SYST:STRI {token}").body, "STRI")
        same = self._token != 0 and before == self._token
        self._unbroken = self._unbroken and same  # a greeting that broke off may have met a gun that was reset
        named = Named.parse(self._greet("*IDN?").body)
        self._check(named)
        self._greet(f"SYST:WATC {self._watchdog_ms}")
        with self.lock:
            self._token = token
            if not same:
                self._clocks = lines.Clocks()
        for _ in range(FIRST_EXCHANGES):
            self._greet("TIME?")
        with self.lock:
            self.named, self.remembers, self._unbroken = named, self._unbroken, True
            self.why_lost = self._why_ended()
            self.boot += not self.remembers
            self.session += 1
            self._up.set()

    def _why_ended(self) -> str:
        """What ended the session before, now that it is known whether the gun remembers it."""
        ended = self._ended_by
        if ended is None:
            return ""
        if not self.remembers:
            return f"the gun does not know its last session any more, so it was reset ({ended})"
        return ended.alone if isinstance(ended, lines.Forgotten) else f"the line was lost ({ended})"

    def _introduce(self, port: lines.Port) -> None:
        """See who is there, in the plain language that every version speaks; who is wrong there must say so twice."""
        said = list[bytes]()
        for _ in range(GREETING_TRIES):
            self._plain = b""
            port.write(b"\n*IDN?\n")
            end_s = machine_s() + PATIENCE_S
            while not self._plain and machine_s() < end_s and not self.closing.is_set():
                self._pump()
            try:
                self._check(Named.parse(self._plain.decode("latin-1")))
            except (Garbled, lines.WrongVersion, lines.AnotherGun):
                said.append(self._plain)
                if len(said) > 1 and said[-1] == said[-2] != b"":
                    raise
                continue
            return
        raise lines.TimedOut("nobody there says that it is a gun")

    def _check(self, named: Named) -> None:
        if named.wire != WIRE_VERSION:
            raise lines.WrongVersion(
                f"{named.model} {named.serial} (firmware {named.firmware}) speaks version {named.wire} of the wire, "
                f"this Recoil version {WIRE_VERSION}; flash the firmware of this Recoil (device/firmware)"
            )
        if self.named is not None and named.serial != self.named.serial:
            raise lines.AnotherGun(f"another gun is there now: {named.serial}, not {self.named.serial}")

    def _greet(self, body: str) -> lines.Reply:
        """Ask from the thread that reads. What is asked here may be asked again."""
        trouble: LinkError | None = None
        for _ in range(GREETING_TRIES):
            waiting = self._write(body)
            end_s = machine_s() + PATIENCE_S
            while not waiting.ended.is_set() and machine_s() < end_s and not self.closing.is_set():
                self._pump()
            try:
                return self._pending.outcome(waiting)
            except (lines.TimedOut, Garbled) as error:
                trouble = error
        raise trouble or lines.TimedOut("no answer")

    def _write(self, body: str) -> lines.Waiting:
        with self.lock:
            if self._port is None or self._broken:
                raise lines.Disconnected(f"the gun is not there ({self._trouble or 'no answer'})")
            self._number = following(self._number)
            now_s = machine_s()
            waiting = lines.Waiting(
                number=self._number,
                body=body,
                written_s=self._clock(),
                since_s=now_s,
                gap_s=now_s - self.written_s,
            )
            self._pending.add(waiting)
            try:
                self._port.write(encode(Frame(number=waiting.number, body=body), "host"))
            except LinkError as error:
                self._pending.take(waiting.number)
                self._lose(error)
                raise
            waiting.gap_s += machine_s() - now_s
            self.written_s = machine_s()
        return waiting

    def _pump(self) -> None:
        """Read what is there, and hand the answers out."""
        port = self._port
        if port is None or self._broken:
            raise lines.Disconnected(str(self._trouble or "the line is gone"))
        data = port.read()
        received_s = self._clock()
        for line in self._splitter.feed(data):
            self._heard_s = machine_s()
            self._take(line, received_s)

    def _take(self, line: bytes | None, received_s: float) -> None:
        if line is not None and line[:1] not in {b"<", b""}:
            self._plain = line
            if line.startswith(PLAIN_NAME):  # of a question that was asked before the session, however late
                return
        try:
            frame = decode(line or b"", "gun")
        except Garbled as error:
            self._pending.end_all(Garbled(f"the answer was garbled: {error}"))
            return
        if frame.body == "NAK":
            self._pending.end_all(Garbled("the gun understood no line"))
            return
        waiting = self._pending.take(frame.number)
        if waiting is None:  # its deadline has passed, or it was written before the line was lost
            return
        if frame.body == _NO_SESSION:
            raise lines.Forgotten(self._alone(waiting))
        waiting.reply = lines.Reply(
            body=frame.body, written_s=waiting.written_s, received_s=received_s, session=self.session
        )
        self._learn(waiting, waiting.reply)
        waiting.ended.set()

    def _learn(self, waiting: lines.Waiting, reply: lines.Reply) -> None:
        if waiting.body != "TIME?" or not reply.body.startswith("TIME "):
            return
        exchange = lines.Exchange(
            sent_s=reply.written_s, gun_us=named_value(reply.body, "TIME"), received_s=reply.received_s
        )
        with self.lock:
            self._clocks.add(exchange)

    def _alone(self, waiting: lines.Waiting) -> str:
        """How the gun came to hear nothing for its watchdog's time, as the first frame after it shows."""
        watchdog_ms, gap_ms = 1000 * self.watchdog_s, 1000 * waiting.gap_s
        if gap_ms > watchdog_ms / 2:
            return (
                f"the gun's watchdog disarmed it: this machine was away for {gap_ms:.0f} ms, and the gun waits for "
                f"{watchdog_ms:.0f} ms"
            )
        return (
            f"the gun's watchdog disarmed it: nothing reached it for {watchdog_ms:.0f} ms, though this machine wrote; "
            "check the line"
        )

    def _look_after(self) -> None:
        """Notice a gun that says nothing any more, and forget questions for the time that nobody answered."""
        now_s = machine_s()
        if now_s - self._heard_s > max(SILENT_S, 2 * self.watchdog_s):
            raise lines.Disconnected("the gun says nothing any more")
        self._pending.forget("TIME?", now_s - SILENT_S)

    def _keep_alive(self) -> None:
        """Ask for the time now and then; nobody waits for it, but the clocks learn from it.

        In a thread that does nothing else: it needs the interpreter twice a turn, the one that reads a dozen times, and
        each time may have to wait for it on a busy machine.
        """
        while not self.closing.wait(self._keep_alive_s):
            with self.lock, suppress(LinkError):  # whoever reads is told of it, and connects again
                if self._up.is_set() and not self._leaving:
                    self._write("TIME?")

    def _lose(self, trouble: LinkError) -> None:
        """The line is of no use any more: whoever waits is told. The thread that reads lets go of the port."""
        with self.lock:
            if self._up.is_set():
                self._ended_by = trouble
            self._up.clear()
            self._trouble, self._broken = trouble, True
        self._pending.end_all(lines.Disconnected(str(trouble)))

    def _let_go(self) -> None:
        with self.lock:
            port, self._port = self._port, None
        if port is not None:
            port.close()
