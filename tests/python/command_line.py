"""The command `energymargin` as a process: for tests."""

import subprocess
import sys
from pathlib import Path

COMMAND = str(Path(sys.executable).with_name("energymargin"))


def run(*arguments, cwd):
    """What it says, and its exit code."""
    return subprocess.run(
        [COMMAND, *map(str, arguments)],
        cwd=cwd,
        check=False,
        capture_output=True,
        text=True,
        timeout=120,
    )
