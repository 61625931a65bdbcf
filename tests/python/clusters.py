"""A Dask cluster on this machine, of processes that can be killed: for tests."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import AbstractContextManager
from pathlib import Path

# Where the functions of tests are found that workers run.
TESTS = Path(__file__).parent
PATHS = [str(TESTS), *map(str, TESTS.glob("[a-z]*/"))]


def free_port(host="127.0.0.1"):
    """A port of this machine that nobody listens at."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as door:
        door.bind((host.strip("[]"), 0))
        return door.getsockname()[1]


class Cluster(AbstractContextManager):
    """A scheduler and its workers, each a process of its own; ends them all at the end.

    `settings` are Dask's, as {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"};
    what they print goes to the file `log`. `host` is an address of this machine, also [::1].
    """

    def __init__(self, workers=0, threads=1, log=None, host="127.0.0.1", **settings):
        self.host = host
        self.port = free_port(host)
        self.address = f"tcp://{host}:{self.port}"
        self.threads = threads
        self.workers = []
        self._log = log or subprocess.DEVNULL
        self._environment = {
            **os.environ,
            **settings,
            "PYTHONPATH": os.pathsep.join([*PATHS, os.environ.get("PYTHONPATH", "")]),
        }
        self.start_scheduler()
        for _ in range(workers):
            self.start_worker()

    def start_scheduler(self):
        """Starts one where the last one was; returns when it answers."""
        self.scheduler = self._start(
            "scheduler", "--host", self.host, "--port", str(self.port), "--no-dashboard"
        )
        _await_door((self.host.strip("[]"), self.port), self.scheduler)

    def start_worker(self, *options, nanny=False):
        """A process that looks for the scheduler for a minute; with a nanny, one that is replaced
        when it dies.
        """
        worker = self._start(
            "worker",
            self.address,
            *["--nthreads", str(self.threads)],
            *["--nanny" if nanny else "--no-nanny", "--no-dashboard"],
            *["--host", self.host],
            *options,
        )
        self.workers.append(worker)
        return worker

    def kill_scheduler(self):
        """As a power cut would, with SIGKILL."""
        _kill(self.scheduler)

    def kill_worker(self, number=0):
        """The same of the worker that was started first, or of another one."""
        _kill(self.workers.pop(number))

    def __exit__(self, *_):
        """Kills what still runs."""
        for process in [self.scheduler, *self.workers]:
            _kill(process)

    def _start(self, kind, *options):
        return subprocess.Popen(
            [sys.executable, "-m", "dask", kind, *options],
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=self._log,
            stderr=self._log,
            start_new_session=True,
        )


def workers_of(process):
    """The processes of `Processes` that this one has started."""
    found = []
    for status in Path("/proc").glob("[0-9]*/status"):
        try:
            of_parent = f"\nPPid:\t{process}\n" in status.read_text()
            if of_parent and b"loky.backend.popen_loky" in (status.parent / "cmdline").read_bytes():
                found.append(int(status.parent.name))
        except OSError:  # it has just ended
            continue
    return found


def _kill(process):
    """And all that it has started, as a nanny its worker."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _await_door(address, process):
    end = time.monotonic() + 30
    while time.monotonic() < end and process.poll() is None:
        try:
            socket.create_connection(address, 1).close()
            return
        except OSError:
            time.sleep(0.05)
    raise RuntimeError(f"no scheduler at {address} after 30 s: exit code {process.poll()}")
