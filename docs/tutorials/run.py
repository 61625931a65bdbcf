"""Runs the tutorials again, and stores what they print and draw in them.

python docs/tutorials/run.py [NOTEBOOK ...]      all of them, if none is named
"""

from __future__ import annotations

import asyncio
import base64
import io
import re
import signal
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode
from PIL import Image

FOLDER = Path(__file__).parent
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}
LONGEST_CELL = 300  # s
ADDRESS = re.compile(r" at 0x[0-9a-f]+")  # of a Python object, another one in each run
ONCE = re.compile(r"(decomposing .* into convex parts, once: .*\n?)+")  # what a first run says


def tutorials() -> list[Path]:
    """The notebooks, in order of learning."""
    return sorted(FOLDER.glob("*.ipynb"))


def executed(path: Path) -> NotebookNode:
    """A notebook after a fresh run in an empty folder, without what differs from run to run.

    Raises nbclient's CellExecutionError if a cell does.
    """
    notebook = nbformat.read(path, as_version=4)
    with TemporaryDirectory() as folder:
        NotebookClient(
            notebook,
            kernel_name="python3",
            extra_arguments=["--log-level=ERROR"],
            resources={"metadata": {"path": folder}},
            timeout=LONGEST_CELL,
            record_timing=False,
            coalesce_streams=True,
            shutdown_kernel="immediate",
            on_cell_start=_let_ctrl_c_through,
        ).execute()
    return _lasting(notebook)


def _let_ctrl_c_through(**_: Any) -> None:
    """Takes Ctrl-C back from nbclient, which would end the kernel and then trip over that."""
    asyncio.get_running_loop().remove_signal_handler(signal.SIGINT)


def _lasting(notebook: NotebookNode) -> NotebookNode:
    """What stays the same in the next run: ids, sources, outputs."""
    notebook.metadata = nbformat.from_dict(METADATA)
    for cell in notebook.cells:
        cell.metadata = NotebookNode()
        outputs = cell.get("outputs", [])
        outputs[:] = [one for one in outputs if not ONCE.fullmatch(one.get("text", ""))]
        for output in outputs:
            output.pop("metadata", None)
            if output.output_type in ("execute_result", "display_data"):
                output.metadata = NotebookNode()
            data = output.get("data", {})
            if "text/plain" in data:
                data["text/plain"] = ADDRESS.sub("", data["text/plain"])
            if "image/png" in data:
                data["image/png"] = _smaller(data["image/png"])
    return notebook


def _smaller(image: str) -> str:
    """A picture in base64 with a palette of 256 colours, a third of the size."""
    packed = io.BytesIO()
    with Image.open(io.BytesIO(base64.b64decode(image))) as picture:
        palette = picture.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    palette.save(packed, "png", optimize=True)
    return base64.b64encode(packed.getvalue()).decode()


def main(paths: list[Path]) -> None:
    """Runs and saves each; one that fails stays as it was."""
    for path in paths or tutorials():
        notebook = executed(path)
        nbformat.validate(notebook)
        nbformat.write(notebook, path)
        print(f"{path.name}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    try:
        main([Path(argument) for argument in sys.argv[1:]])
    except KeyboardInterrupt:
        sys.exit("stopped; the tutorials not named above are as they were")
