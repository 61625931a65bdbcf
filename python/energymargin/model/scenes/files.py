"""Files that come with the package, and those that a robot's file names."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import unquote, urlparse

USD = (".usd", ".usda", ".usdc", ".usdz")


def require_robot(path: str | Path) -> None:
    """Raises ValueError on a file of a robot in a format that is not read, with the way out."""
    suffix = Path(path).suffix.lower()
    if suffix in USD:
        raise ValueError(
            f"{path} is USD, which is not read: expected URDF (em.scenes.from_urdf) or MJCF "
            "(em.scenes.from_mjcf), as the robot's source has, or as Isaac Sim's exporter writes"
        )
    if suffix in (".sdf", ".xacro", ".srdf"):
        way = {
            ".sdf": "gz sdf --print reads SDF, and sdformat_urdf makes URDF of it",
            ".xacro": "`xacro FILE -o robot.urdf` makes URDF of it",
            ".srdf": "it has groups of a robot whose URDF is another file",
        }[suffix]
        raise ValueError(f"{path} is {suffix[1:].upper()}, expected URDF or MJCF: {way}")


def data_file(name: str) -> Path:
    """A file of the package's `data` folder.

    Raises FileNotFoundError if there is none of that name.
    """
    package = Path(__file__).parents[2]
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
