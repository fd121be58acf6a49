"""Pipes to and from a child, in a program that may not be Python's own: Blender leaves SIGPIPE at what ends a process."""

from __future__ import annotations

import os
import select
import signal
import time
from typing import IO


def send(stream: IO[bytes], data: bytes) -> bool:
    """Writes all of it to an unbuffered pipe; False if nobody reads there any more."""
    if os.name == "nt":
        return _write(stream, data)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGPIPE})
    try:
        sent = _write(stream, data)
        if not sent and signal.SIGPIPE in signal.sigpending():
            signal.sigwait({signal.SIGPIPE})  # it is this write's
        return sent
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _write(stream: IO[bytes], data: bytes) -> bool:
    rest = memoryview(data)
    try:
        while rest:
            rest = rest[os.write(stream.fileno(), rest) :]
    except (OSError, ValueError):  # ValueError: it was closed here
        return False
    return True


def readable(stream: IO[bytes], seconds: float) -> bool:
    """Whether it can be read without waiting, or has ended; waits for that as long."""
    if os.name != "nt":
        return bool(select.select([stream.fileno()], [], [], seconds)[0])
    return _readable_on_windows(stream.fileno(), seconds)


def _readable_on_windows(descriptor: int, seconds: float) -> bool:
    """A pipe there can only be looked into."""
    import _winapi
    import msvcrt

    handle = msvcrt.get_osfhandle(descriptor)  # type: ignore[attr-defined]
    end = time.monotonic() + seconds
    while True:
        try:
            if _winapi.PeekNamedPipe(handle, 0)[0]:  # type: ignore[attr-defined]
                return True
        except OSError:  # its other end is closed
            return True
        if time.monotonic() >= end:
            return False
        time.sleep(0.005)
