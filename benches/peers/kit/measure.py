"""Runs of child processes, with what they cost."""

import json
import os
import signal
import subprocess
import tempfile
import threading
import time
from dataclasses import dataclass, field


@dataclass
class Run:
    """What a process cost, and what it answered.

    CPU seconds are user and system time of the process and its threads as the system counts them;
    the answer is the JSON object on its standard output, if there is one; the text is all of that.
    """

    cpu: float = 0.0
    wall: float = 0.0
    peak: int = 0
    answer: dict = field(default_factory=dict)
    text: str = ""
    fault: str = ""


def run(command, seconds):
    """Runs the command to its end, or ends it after that many seconds of wall time."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
        start = time.perf_counter()
        try:
            child = subprocess.Popen(command, stdout=out, stderr=errors, start_new_session=True)
        except OSError as fault:
            return Run(fault=str(fault))
        late = threading.Event()

        def end():
            late.set()
            os.killpg(child.pid, signal.SIGKILL)

        timer = threading.Timer(seconds, end)
        timer.start()
        _, status, usage = os.wait4(child.pid, 0)
        wall = time.perf_counter() - start
        timer.cancel()
        child.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        errors.seek(0)
        text, complaint = out.read(), errors.read().strip()
    done = Run(usage.ru_utime + usage.ru_stime, wall, 1024 * usage.ru_maxrss)
    if late.is_set():
        done.fault = f"not done after {seconds:g} s"
        return done
    if child.returncode != 0:
        done.fault = (complaint.splitlines() or [f"exit code {child.returncode}"])[-1][:200]
    done.answer, done.text = answer(text), text
    return done


def answer(text):
    """The last line that is a JSON object, or the whole text if that is one."""
    for candidate in [text, *reversed(text.splitlines())]:
        try:
            found = json.loads(candidate)
        except ValueError:
            continue
        if isinstance(found, dict):
            return found
    return {}
