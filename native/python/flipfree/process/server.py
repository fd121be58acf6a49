"""The child's side: calls come in as lines on the standard input, where they stand and what became of them goes out."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import shutil
import signal
import sys
import threading
from pathlib import Path

from .. import jobs
from ..errors import FlipfreeError
from ..job import POLL_SECONDS, ours_only
from .pipes import Message, die_with, read_object, say, write_object

_NICER = 5


def main(opening: Message) -> None:
    """opening: {"parent": pid, "folder": where calls and answers lie}. Does not return."""
    _stand_back()
    folder = Path(opening["folder"])
    signal.signal(signal.SIGTERM, lambda *_: _leave(folder))
    if not die_with(opening["parent"], signal.SIGTERM):
        _leave(folder)
    messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(messages, folder), daemon=True).start()
    say({"ready": True})
    while True:
        message = messages.get()
        if "call" in message:
            _answer(message, folder, messages)


def _listen(messages: queue.SimpleQueue[Message], folder: Path) -> None:
    """Nothing more to read: the parent is no longer there, and nobody waits for what is being solved."""
    with contextlib.suppress(OSError, ValueError):
        for line in iter(sys.stdin.buffer.readline, b""):
            messages.put(json.loads(line))
    _leave(folder)


def _leave(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)


def _answer(message: Message, folder: Path, messages: queue.SimpleQueue[Message]) -> None:
    number, target = message["call"], folder / f"answer-{message['call']}"
    try:
        _solved(folder / f"call-{number}", target, messages)
    except FlipfreeError as error:
        write_object(target, ("error", error))
    say({"answer": number})


@ours_only
def _solved(call: Path, target: Path, messages: queue.SimpleQueue[Message]) -> None:
    """Writes what a call returns."""
    name, arguments, options = read_object(call)
    job = getattr(jobs, name)(*arguments, **options)
    told = None
    while not job.wait(POLL_SECONDS):
        now = job.progress()
        if now != told:
            told = now
            say({"progress": now})
        while not messages.empty():
            if "accept" in messages.get():
                job.accept()
    write_object(target, ("result", job.result()))


def _stand_back() -> None:
    """The parent is what somebody works with: it has the processor first, and where the system ends a process because memory
    runs out, it shall be this one."""
    with contextlib.suppress(OSError):
        if os.name == "posix":
            os.nice(_NICER)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("600")
