"""Files that come with the package, and those that a robot's file names."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import unquote, urlparse


def data_file(name: str) -> Path:
    """A file of the package's `data` folder.

    Raises FileNotFoundError if there is none of that name.
    """
    package = Path(__file__).parents[1]
    for folder in (package / "data", package.parents[1] / "data"):  # installed, or in a checkout
        if (folder / name).is_file():
            return folder / name
    raise FileNotFoundError(f"energymargin has no data file {name!r}")


def found(name: str, beside: Path, packages: Sequence[str | Path]) -> Path:
    """The file that a robot's file, `beside`, calls by a path, file:// or package://.

    A package is looked for in `packages`, in the folders of ROS_PACKAGE_PATH and in those above
    the robot's file; each of `packages` may be the package itself. A relative path is looked for in
    the same folders. Raises FileNotFoundError that lists them, ValueError on another scheme.
    """
    scheme, _, rest = name.rpartition("://")
    if scheme not in ("", "file", "package"):
        raise ValueError(f"{beside} has {name!r}, expected a path, file:// or package://")
    if scheme == "file":
        rest = unquote(urlparse(name).path)
    candidates = list(_candidates(rest, scheme == "package", beside.resolve().parent, packages))
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    folders = "\n  ".join(dict.fromkeys(str(c) for c in candidates))
    raise FileNotFoundError(
        f"{beside} has {name!r}, which is none of these; packages=(...) adds folders:\n  {folders}"
    )


def _candidates(
    path: str, in_package: bool, folder: Path, packages: Sequence[str | Path]
) -> Iterator[Path]:
    given = [Path(package) for package in packages]
    ros = [Path(p) for p in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p]
    package, _, inside = path.partition("/")
    places = [*given, *ros, folder, *folder.parents]
    for place in places if in_package else [folder, *places]:
        yield place / path
        if in_package and (place in given or place.name == package):
            yield place / inside
