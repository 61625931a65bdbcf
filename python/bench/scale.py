"""What scoring millions of states takes: throughput of the executors, memory, and cost on paper.

`make bench-scale` runs this. The tables are those of docs/engineering/scale.md.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import cyclopts
from cyclopts import Parameter
from cyclopts.types import PositiveInt

from scale_cost import Cost, Sizes, measure_cost
from scale_memory import Memory, measure_memory, picture
from scale_throughput import Throughput, measure_throughput
from tables import machine, write

PARTS = {
    "throughput": "Throughput",
    "memory": "Memory",
    "cost": "Cost of a state, and of ten million",
}
Part = Throughput | Memory | Cost


def main(
    *,
    parts: Annotated[str, Parameter(help="With commas between.")] = ",".join(PARTS),
    rounds: Annotated[PositiveInt, Parameter(help="Of the throughput.")] = 5,
    data: Annotated[
        Path | None,
        Parameter(help="A dataset for the memory, instead of one that is generated."),
    ] = None,
    quick: Annotated[bool, Parameter(negative=(), help="Little: does it work?")] = False,
    out: Annotated[Path, Parameter(help="Folder for scale.md, scale.json, memory.png.")] = Path(
        "out"
    ),
    pages: Annotated[Path | None, Parameter(help="Folder of pages, as docs.")] = None,
) -> None:
    """Measures, and writes what there is, also after Ctrl-C."""
    chosen = parts.split(",")
    if unknown := sorted(set(chosen) - set(PARTS)):
        raise SystemExit(f"parts has {unknown[0]!r}, expected some of {', '.join(PARTS)}")
    folder = out / "scale"
    folder.mkdir(parents=True, exist_ok=True)
    measured: dict[str, Part] = {}
    load, interrupted = os.getloadavg()[0], False
    try:
        for part in chosen:
            start(part, measured, folder, quick=quick, rounds=rounds, data=data)
    except KeyboardInterrupt:
        interrupted = True
    text = report(measured, load)
    print(text)
    numbers = {part: results.numbers() for part, results in measured.items()}
    (out / "scale.json").write_text(json.dumps(numbers, indent=1))
    memory = measured.get("memory")
    pictures = []
    if isinstance(memory, Memory) and memory.scored:
        pictures = [out / "memory.png"]
        picture(memory, pictures[0])
    shown = None if interrupted or quick else pages
    write(out / "scale.md", text, "bench-scale", shown, *pictures)
    if interrupted:
        raise SystemExit(128 + signal.SIGINT)


def start(
    part: str,
    measured: dict[str, Part],
    folder: Path,
    *,
    quick: bool,
    rounds: int,
    data: Path | None,
) -> None:
    """Measures one part; what there is of it is in `measured` also if it is interrupted."""
    if part == "throughput":
        throughput = Throughput(10, {"topple": 60}) if quick else Throughput()
        measured[part] = throughput
        measure_throughput(throughput, folder, 1 if quick else rounds, tell)
    elif part == "memory":
        memory = Memory((100, 1000)) if quick else Memory()
        measured[part] = memory
        measure_memory(memory, folder, data, tell)
    else:
        cost = Cost(Sizes().quick() if quick else Sizes())
        measured[part] = cost
        measure_cost(cost, folder, tell)


def report(measured: Mapping[str, Part], load: float) -> str:
    """All there is, in Markdown."""
    versions = machine("numpy", "dask")
    head = f"# Scale\n\n{versions}; load {load:.1f} before.\n"
    return "\n".join(
        [head, *(f"## {PARTS[part]}\n\n{one.tables()}" for part, one in measured.items())]
    )


def tell(what: str) -> None:
    """Says what is measured now."""
    print(what, file=sys.stderr, flush=True)


if __name__ == "__main__":
    cyclopts.run(main)
