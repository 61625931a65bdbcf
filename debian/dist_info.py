"""Writes what an installed package says of itself: dist_info.py DIST-PACKAGES."""

import re
import sys
from pathlib import Path

import tomllib

project = tomllib.loads(Path("pyproject.toml").read_text())["project"]
version = re.search(r"project\(energymargin VERSION (\S+)", Path("CMakeLists.txt").read_text())[1]
folder = Path(sys.argv[1]) / f"energymargin-{version}.dist-info"
folder.mkdir()
(folder / "METADATA").write_text(
    f"Metadata-Version: 2.1\nName: energymargin\nVersion: {version}\n"
    f"Summary: {project['description']}\nRequires-Python: {project['requires-python']}\n"
)
groups = {"console_scripts": project["scripts"], **project["entry-points"]}
(folder / "entry_points.txt").write_text(
    "\n".join(
        f"[{group}]\n" + "".join(f"{name} = {place}\n" for name, place in entries.items())
        for group, entries in groups.items()
    )
)
(folder / "INSTALLER").write_text("debian\n")
