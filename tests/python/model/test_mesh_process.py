"""The process that decomposes a mesh ends with the call that started it."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pybullet_data
import pytest

import energymargin as em
from energymargin.meshes import mesh

DATA = Path(pybullet_data.getDataPath())

pytestmark = pytest.mark.usefixtures("mesh_cache")


def test_ctrl_c_ends_a_decomposition_at_once_and_leaves_no_process(tmp_path, monkeypatch):
    started = []
    run = subprocess.Popen

    def remembered(*args, **kwargs):
        started.append(run(*args, **kwargs))
        return started[0]

    monkeypatch.setattr(subprocess, "Popen", remembered)
    pressed = []

    def press():
        while not started:
            time.sleep(0.01)
        time.sleep(0.5)
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=press).start()
    with pytest.raises(KeyboardInterrupt):
        mesh(DATA / "husky/meshes/wheel.stl", threshold=0.01)  # a minute
    assert time.monotonic() - pressed[0] < 0.2
    assert started[0].poll() == -signal.SIGKILL


@pytest.mark.parametrize("how", ["timeout", "cancel"])
def test_a_decomposition_ends_at_its_limit_without_a_process_or_a_mesh(how, monkeypatch):
    started = []
    run = subprocess.Popen

    def remembered(*args, **kwargs):
        started.append(run(*args, **kwargs))
        return started[-1]

    monkeypatch.setattr(subprocess, "Popen", remembered)
    cancel = em.Cancel()
    threading.Timer(0.5, cancel.set).start()
    limit = {"timeout": 0.5} if how == "timeout" else {"cancel": cancel}
    error = TimeoutError if how == "timeout" else em.Cancelled
    with pytest.raises(error, match=r"wheel\.stl was decomposed"):
        mesh(DATA / "husky/meshes/wheel.stl", threshold=0.01, **limit)  # a minute
    assert started[-1].poll() == -signal.SIGKILL


# Says its child's number before it decomposes a mesh, which takes a minute.
PARENT = """
import subprocess, sys
from energymargin.meshes import mesh

run = subprocess.Popen

def told(*args, **kwargs):
    process = run(*args, **kwargs)
    print(process.pid, args[0][-1], flush=True)
    return process

subprocess.Popen = told
mesh(sys.argv[1], threshold=0.01)
"""


def runs(pid):
    """Whether a process runs; one that nobody has waited for yet does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_a_killed_parent_leaves_no_process_and_no_folder(tmp_path):
    environment = {**os.environ, "ENERGYMARGIN_CACHE": str(tmp_path), "TMPDIR": str(tmp_path)}
    command = [sys.executable, "-c", PARENT, str(DATA / "husky/meshes/wheel.stl")]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as parent:
        pid, folder = parent.stdout.readline().split()
        assert runs(pid) and Path(folder).is_dir()
        parent.kill()
    while runs(pid):
        time.sleep(0.02)
    assert not Path(folder).exists()
