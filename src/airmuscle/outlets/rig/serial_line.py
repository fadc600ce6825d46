"""Serial line to a rig: a text protocol, its driver, and the device at its other end.

    HELLO                  ->  AIRMUSCLE 1 WATCHDOG COMMANDS SENSORS
    START                  ->  OK START
    SET NUMBER VALUES      ->  NOW NUMBER READINGS
    STOP                   ->  OK STOP
    anything else          ->  ERR TEXT

Each line is followed by `*`, the exclusive or of its bytes as two hexadecimal digits (as in NMEA
0183), and a line feed. WATCHDOG is in milliseconds, COMMANDS and SENSORS are names between commas,
VALUES and READINGS decimal numbers in SI units (gauge pressures in Pa) between blanks, in that
order. The device vents when it is switched on, at STOP, and when no SET arrives for WATCHDOG; it
then refuses SET until the next START.
"""

import contextlib
import os
import select
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ...core import RigError
from .simulated_rig import SimulatedRig

VERSION = "1"
TIMEOUT = 0.2
"""Time for an answer [s] (chosen)."""
WATCHDOG = 0.2
"""Time without commands after which the simulated device vents [s] (chosen)."""
LONGEST = 4096
"""Greatest length of a line in bytes (chosen)."""


def framed(body: str) -> bytes:
    """A line with its check sum."""
    return f"{body}*{_check_sum(body.encode()):02X}\n".encode()


def _check_sum(body: bytes) -> int:
    total = 0
    for byte in body:
        total ^= byte
    return total


def unframed(line: bytes) -> str | None:
    """The body of a line; None if its check sum is wrong."""
    body, star, digits = line.strip().rpartition(b"*")
    if not star or digits.upper() != f"{_check_sum(body):02X}".encode():
        return None
    return body.decode("ascii", "replace")


class LinePort:
    """Lines over an open file descriptor of a serial port or a pseudo-terminal."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        self._buffer = b""

    def send(self, body: str) -> None:
        """Send a line. Raises RigError if the line is lost."""
        data = framed(body)
        try:
            while data:
                data = data[os.write(self.descriptor, data) :]
        except OSError as error:
            raise RigError(f"serial line: the connection is lost ({error.strerror}).") from None

    def receive(self, timeout: float) -> bytes | None:
        """The next line without check; None if none comes within the time [s]. Raises RigError if
        the line is lost.
        """
        end = time.monotonic() + timeout
        while b"\n" not in self._buffer:
            remaining = end - time.monotonic()
            if remaining <= 0.0 and timeout > 0.0:
                return None
            try:
                ready, _, _ = select.select([self.descriptor], [], [], max(remaining, 0.0))
                data = os.read(self.descriptor, LONGEST) if ready else b""
            except OSError as error:
                raise RigError(f"serial line: the connection is lost ({error.strerror}).") from None
            if ready and not data:
                raise RigError("serial line: the connection is closed.")
            if not ready:
                return None
            self._buffer = (self._buffer + data)[-LONGEST:]
        line, _, self._buffer = self._buffer.partition(b"\n")
        return line

    def clear(self) -> None:
        """Forget what has arrived."""
        self._buffer = b""


class SerialRig:
    """A rig at a serial port (POSIX: Linux, macOS), opened at `baud`; a context manager that vents.

    `commands` and `sensors` are the names that the device states, `watchdog` [s] its time without
    commands after which it vents. Raises RigError if it does not answer.
    """

    def __init__(self, path: str | Path, baud: int = 115200, timeout: float = TIMEOUT) -> None:
        self.timeout = timeout
        self._number = 0
        self._has_started = False
        self._port = LinePort(_open_port(path, baud))
        try:
            words = self._ask("HELLO", "AIRMUSCLE", trials=3)
            if len(words) != 4 or words[0] != VERSION:
                raise RigError(f"{path}: the device speaks another protocol: {' '.join(words)}.")
            self.watchdog = 1e-3 * float(words[1])
            self.commands = tuple(words[2].split(","))
            self.sensors = tuple(words[3].split(","))
        except BaseException:
            os.close(self._port.descriptor)
            raise

    def __enter__(self) -> "SerialRig":
        return self

    def __exit__(self, *exception: Any) -> None:
        self.close()

    def write(self, commands: Mapping[str, float]) -> None:
        """Set the gauge pressures [Pa] by name; the first call starts the device."""
        missing = sorted(set(self.commands) ^ set(commands))
        if missing:
            raise RigError(
                f"serial line: the commands differ from those of the device in"
                f" {', '.join(missing)}."
            )
        if not self._has_started:
            self._ask("START", "OK", trials=1)
            self._has_started = True
        self._number += 1
        values = " ".join(f"{commands[name]:.3f}" for name in self.commands)
        self._port.send(f"SET {self._number} {values}")

    def read(self) -> dict[str, float]:
        """The readings [SI] that answer the last command."""
        words = self._answer("NOW", str(self._number))
        try:
            values = [float(word) for word in words]
        except ValueError:
            raise RigError(f"serial line: the readings are no numbers: {words}.") from None
        if len(values) != len(self.sensors):
            raise RigError(
                f"serial line: {len(values)} readings arrived for {len(self.sensors)} sensors."
            )
        return dict(zip(self.sensors, values, strict=True))

    def stop(self) -> None:
        """Vent, and wait for the confirmation."""
        self._port.clear()
        self._ask("STOP", "OK", trials=1)
        self._has_started = False

    def close(self) -> None:
        """Vent, if the line is not lost, and close the port."""
        with contextlib.suppress(RigError):
            self.stop()
        with contextlib.suppress(OSError):
            os.close(self._port.descriptor)

    def _ask(self, question: str, answer: str, trials: int) -> list[str]:
        for trial in range(trials):
            self._port.send(question)
            try:
                return self._answer(answer, question if answer == "OK" else "")
            except RigError:
                if trial == trials - 1:
                    raise
        raise AssertionError("no trial")

    def _answer(self, kind: str, first: str) -> list[str]:
        """The words of the answer of a kind whose first word is this one, if one is asked for;
        answers to earlier questions are passed over.
        """
        end = time.monotonic() + self.timeout
        while (remaining := end - time.monotonic()) > 0.0:
            line = self._port.receive(remaining)
            if line is None:
                break
            body = unframed(line)
            if body is None:
                continue
            word, *words = body.split()
            if word == "ERR":
                raise RigError(f"serial line: the device refuses: {' '.join(words)}.")
            if word == kind and (not first or words[:1] == [first]):
                return words[1:] if first else words
        raise RigError(f"serial line: no answer within {1e3 * self.timeout:.0f} ms.")


def _open_port(path: str | Path, baud: int) -> int:
    try:
        import termios
        import tty
    except ImportError:
        raise RigError(
            "serial line: this system has no POSIX terminals; give `play` a rig of your own with"
            " write, read and stop."
        ) from None
    speed = getattr(termios, f"B{baud}", None)
    if speed is None:
        raise RigError(f"serial line: {baud} baud is not a rate of this system; usual is 115200.")
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY)
    except OSError as error:
        raise RigError(
            f"{path}: the port cannot be opened ({error.strerror}). Check the cable and the rights"
            " of the port."
        ) from None
    try:
        tty.setraw(descriptor)
        modes = termios.tcgetattr(descriptor)
        modes[4] = speed
        modes[5] = speed
        termios.tcsetattr(descriptor, termios.TCSANOW, modes)
    except termios.error as error:
        os.close(descriptor)
        raise RigError(f"{path}: this is no serial port ({error}).") from None
    return descriptor


class SerialDevice:
    """The other end of the line, as firmware has it: a simulated rig that advances with the clock
    and vents by its watchdog.
    """

    def __init__(
        self,
        rig: SimulatedRig,
        descriptor: int,
        watchdog: float = WATCHDOG,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.rig = rig
        self.watchdog = watchdog
        self.has_started = False
        self._port = LinePort(descriptor)
        self._clock = clock
        self._last_set = self._last_step = clock()

    def serve(self, is_over: Callable[[], bool], poll: float = 0.005) -> None:
        """Answer lines until `is_over`; a lost line vents, as the watchdog does."""
        while not is_over():
            line = None
            with contextlib.suppress(RigError):
                line = self._port.receive(poll)
            self.watch()
            body = None if line is None else unframed(line)
            if body:
                with contextlib.suppress(RigError):
                    self._port.send(self.answer(body))

    def watch(self) -> None:
        """Vent if no command has arrived for the time of the watchdog."""
        if self.has_started and self._clock() - self._last_set > self.watchdog:
            self._vent()

    def answer(self, body: str) -> str:
        """The answer to the body of a line."""
        word, *words = body.split()
        if word == "HELLO":
            names = f"{','.join(self.rig.commands)} {','.join(self.rig.sensors)}"
            return f"AIRMUSCLE {VERSION} {1e3 * self.watchdog:.0f} {names}"
        if word == "START":
            self.has_started = True
            self._last_set = self._last_step = self._clock()
            return "OK START"
        if word == "STOP":
            self._vent()
            return "OK STOP"
        if word != "SET":
            return f"ERR unknown word {word}"
        if not self.has_started:
            return "ERR not started"
        return self._set(words)

    def _set(self, words: list[str]) -> str:
        try:
            values = [float(word) for word in words[1:]]
            commands = dict(zip(self.rig.commands, values, strict=True))
        except ValueError:
            return "ERR unreadable values"
        now = self._clock()
        self._last_set = now
        duration = max(now - self._last_step, 1e-4)
        self._last_step = now
        readings = self.rig.advance(duration)
        self.rig.write(commands)
        return " ".join(["NOW", words[0], *(f"{value:.6g}" for value in readings.values())])

    def _vent(self) -> None:
        self.has_started = False
        self.rig.stop()
