"""A disk that is full: no file of this process can be longer than so many bytes."""

import resource
import signal
from contextlib import contextmanager


@contextmanager
def full_disk(left=0):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    as_ever = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (left, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, as_ever)
