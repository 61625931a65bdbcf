"""Recordings of a known motion, as CSV files, and cells that may stand in one."""

import numpy as np
from hypothesis import HealthCheck, settings, strategies as st

POSES = [f"{body}_{axis}" for body in ("object", "effector") for axis in ("x", "y", "yaw")]
RATES = [f"{body}_{axis}" for body in ("object", "effector") for axis in ("vx", "vy", "yaw_rate")]
HEADER = ["frame", "time", *POSES[:3], *RATES[:3], *POSES[3:], *RATES[3:]]
NOISE = (5e-4, 5e-4, np.radians(0.5))  # m, m, rad; a camera's

CELLS = st.one_of(
    st.floats().map(str),
    st.integers().map(str),
    st.sampled_from(["", "nan", "1e308", "-1e308", "1e-320", "0", "1_0", "٣", '"', "\n", "x\x00"]),
    st.text(max_size=4),
)
one_folder = settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture]
)  # each example writes its file anew


def push(frames=100, rate=33.0):
    """A push of 5 cm/s by columns, without noise: K numbers each, in SI units.

    The effector goes along y and a bit aside, the object turns back and forth, and past pi.
    """
    time = np.arange(frames) / rate
    wave = 2 * np.pi * 0.5
    columns = {
        "frame": np.arange(frames),
        "time": time,
        "object_x": 0.10 + 0.01 * np.sin(wave * time),
        "object_y": 0.05 * time,
        "object_yaw": 3.1 + 0.2 * np.sin(wave * time),
        "object_vx": 0.01 * wave * np.cos(wave * time),
        "object_vy": np.full(frames, 0.05),
        "object_yaw_rate": 0.2 * wave * np.cos(wave * time),
        "effector_x": 0.10 + 0.02 * time,
        "effector_y": 0.05 * time - 0.06,
        "effector_yaw": np.full(frames, 0.1),
        "effector_vx": np.full(frames, 0.02),
        "effector_vy": np.full(frames, 0.05),
        "effector_yaw_rate": np.zeros(frames),
    }
    return columns


def poses_of(columns):
    """Without the velocities."""
    return {name: values for name, values in columns.items() if name not in RATES}


def noisy(columns, seed=0):
    """With a camera's noise on the poses."""
    random = np.random.default_rng(seed)
    sizes = dict(zip(POSES, 2 * NOISE, strict=True))
    return {
        name: values + random.normal(0, sizes[name], len(values)) if name in sizes else values
        for name, values in columns.items()
    }


def rows_of(columns):
    """Lists of cells, one a frame."""
    return [
        [
            str(int(cell)) if name == "frame" else f"{cell:.6f}"
            for name, cell in zip(columns, row, strict=True)
        ]
        for row in zip(*columns.values(), strict=True)
    ]


def write(path, columns, rows=None, header=None, delimiter=","):
    """A file of these columns; `rows`: other rows of cells, `header`: another one, or none: ()."""
    lines = [
        list(columns) if header is None else header,
        *(rows_of(columns) if rows is None else rows),
    ]
    text = "".join(delimiter.join(line) + "\n" for line in lines if len(line) > 0)
    path.write_text(text, encoding="utf-8")
    return path
