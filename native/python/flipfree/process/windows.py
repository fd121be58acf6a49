"""What Windows has instead of signals, file locks and /proc. Imported there alone."""

from __future__ import annotations

import _winapi
import ctypes
import msvcrt
import struct
import sys
from typing import BinaryIO

assert sys.platform == "win32"

_kernel32 = ctypes.WinDLL("kernel32", use_last_error=True)
_kernel32.CreateJobObjectW.restype = ctypes.c_void_p
_EXTENDED_LIMITS = 9  # JobObjectExtendedLimitInformation, 144 bytes, its flags at 16
_KILL_ON_CLOSE = 0x2000
_FAR = 1 << 40  # a lock there keeps nobody from reading


def tie(process: int) -> int | None:
    """A job with this process and all that it starts, which end when the job is closed: at the latest with this process. None
    if the system makes none; they have to notice then."""
    job = _kernel32.CreateJobObjectW(None, None)
    limits = bytearray(144)
    struct.pack_into("<I", limits, 16, _KILL_ON_CLOSE)
    if job and not (
        _kernel32.SetInformationJobObject(
            ctypes.c_void_p(job), _EXTENDED_LIMITS, bytes(limits), len(limits)
        )
        and _kernel32.AssignProcessToJobObject(ctypes.c_void_p(job), ctypes.c_void_p(process))
    ):
        _winapi.CloseHandle(job)
        return None
    return job


def close(job: int) -> None:
    _winapi.CloseHandle(job)


def memory(process: int = -1) -> tuple[float, float]:
    """(now, at most so far) of a process by its handle, of this one by default, MB; zeros where the system does not say."""
    counters = ctypes.create_string_buffer(72)  # PROCESS_MEMORY_COUNTERS
    _kernel32.K32GetProcessMemoryInfo(ctypes.c_void_p(process), counters, len(counters))
    most, now = struct.unpack_from("<QQ", counters, 8)
    return now / 2**20, most / 2**20


def waiting(pipe: int) -> bool:
    """Whether a pipe, by its file descriptor, can be read without waiting, or has ended."""
    try:
        return bool(_winapi.PeekNamedPipe(msvcrt.get_osfhandle(pipe), 0)[0])
    except OSError:  # its other end is closed
        return True


def lock(file: BinaryIO) -> bool:
    """Takes a lock that ends with this process, unless another has it."""
    file.seek(_FAR)
    try:
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
    except OSError:
        return False
    finally:
        file.seek(0)
    return True
