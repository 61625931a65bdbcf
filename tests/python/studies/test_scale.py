"""`make bench-scale` on little datasets: that it works, and what it writes; not how fast."""

import json
import subprocess
import sys
from pathlib import Path

from scale_cost import Cost, Driver, Sizes

SCRIPT = Path(__file__).parents[3] / "python" / "bench" / "scale.py"


def run(*arguments):
    return subprocess.run(
        [sys.executable, SCRIPT, *arguments],
        check=False,
        capture_output=True,
        text=True,
        timeout=120,
    )


def cells(text, first):
    """The cells of the row of a table that begins with these."""
    rows = [[c.strip() for c in line.strip("|").split("|")] for line in text.splitlines()]
    row = [row for row in rows if row[: len(first)] == first][-1]
    return row[len(first) :]


def test_each_part_has_its_table_its_numbers_and_the_picture(tmp_path):
    done = run("--quick", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "scale.md").read_text()
    assert text in done.stdout
    for executor in ("1 process", "2 processes", "Dask, 2 workers"):
        rate, ratio, _, start = cells(text, [executor])
        assert float(rate) > 0 and float(ratio.removeprefix("x ")) > 0 and float(start) > 0
    assert cells(text, ["2 threads"])[1] == "x 1.00"
    *_, at_the_end, peak = map(float, cells(text, ["1,000"])[-2:])
    assert 20 < at_the_end <= 1.1 * peak  # two ways to ask the system
    numbers = json.loads((tmp_path / "scale.json").read_text())
    assert [one["states"] for one in numbers["memory"]] == [100, 1000]
    assert numbers["memory"][1]["curve"][-1][0] == 1000
    assert numbers["cost"]["chunks_per_second"] > 0
    assert set(numbers["cost"]["seconds"]["topple"]) == {"5", "10"}
    assert (tmp_path / "memory.png").read_bytes().startswith(b"\x89PNG")


def test_hours_on_paper_are_those_of_the_workers_or_of_the_driver():
    of_search = {"capture": 0.018, "effort/rrt": 0.018}  # 100 core hours
    cost = Cost(Sizes(("push",)), {"push": {100: of_search, 1000: {"capture": 3.6}}}, chunks=500.0)
    cost.drivers["push"] = Driver(0.00036, data=250.0, store=300.0)
    assert cells(cost.tables(), ["push", "100"])[-8:] == [
        *["100", "1.6", "1.0*"],  # 1000 cores wait for a driver that takes an hour
        *["0.36", "1.0", "100", "2.5", "3.0"],
    ]
    assert cells(cost.tables(), ["push", "1000"])[-8:-4] == ["10,000", "156.2", "10.0", "0.36"]


def test_an_unknown_part_is_named():
    done = run("--parts", "memory,juggling")
    assert done.returncode != 0
    assert "'juggling'" in done.stderr
