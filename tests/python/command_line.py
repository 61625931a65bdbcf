"""The command `energymargin`, as a process or in this one: for tests."""

import contextlib
import io
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

from energymargin.cli import app, run as app_run

COMMAND = str(Path(sys.executable).with_name("energymargin"))


def run(*arguments, cwd):
    """What it says, and its exit code."""
    return subprocess.run(
        [COMMAND, *map(str, arguments)],
        cwd=cwd,
        check=False,
        capture_output=True,
        text=True,
        timeout=600,
    )


def run_here(*arguments, cwd):
    """The same in this process, where the libraries are imported once for all of a file's tests."""
    before, stdout, stderr = Path.cwd(), io.StringIO(), io.StringIO()
    os.chdir(cwd)
    try:
        with contextlib.redirect_stdout(stdout), contextlib.redirect_stderr(stderr):
            code = app_run([str(argument) for argument in arguments])
    finally:
        os.chdir(before)
    return subprocess.CompletedProcess(arguments, code, stdout.getvalue(), stderr.getvalue())


def invoke(words):
    """A command in this process: its exit code, and all that it says."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = app_run([str(word) for word in words])
    return SimpleNamespace(exit_code=code, output=said.getvalue())


def every_command(group=app, before=()):
    """Every command but groups as a cyclopts App, by its words after `energymargin`."""
    found = {}
    for name, command in group.resolved_commands().items():
        words = (*before, name)
        if command.default_command is None:
            found |= every_command(command, words)
        elif not name.startswith("-"):
            found[" ".join(words)] = command
    return found
