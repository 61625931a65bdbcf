"""JSON files of GraspGen, alone or as the members of a tar file (a shard of its data set).

Tar files, packed or not, may be a stranger's: what they unpack to is bounded.
"""

from __future__ import annotations

import bz2
import gzip
import io
import json
import lzma
import tarfile
import zlib
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from energymargin.base.checks import numbers_of
from energymargin.grasps.content import Content, column_of, flat, nested, plain

FORMAT, FRAME = "GraspGen", None
LABEL = "object_in_gripper"
EXPECTED = '{"object": {"file", "scale"}, "grasps": {"transforms", "object_in_gripper"}}'


def read(path: Path) -> Content:
    """The grasps of a JSON file. Raises ValueError if it holds something else."""
    return _content(path.read_bytes())


def read_shard(path: Path, where: Mapping[str, Any]) -> Content:
    """The grasps of one object of a tar file: the only one, or where["object"]."""
    wanted = where.get("object")
    name, text = member_of(path, None if wanted is None else str(wanted))
    content = _content(text)
    content.columns["object"] = np.full(len(content.poses), name)
    return content


def write(path: Path, content: Content) -> None:
    """A file as GraspGen's; its success field has true and false."""
    columns = dict(content.columns)
    if LABEL in columns:
        held = columns[LABEL].astype(float)
        if np.isnan(held).any():
            said = "the label of some grasps is not known, expected true or false for GraspGen"
            raise ValueError(f"{said}; write grasps[~np.isnan(grasps.labels)], or give scores")
        columns[LABEL] = held >= 0.5
    grasps = {"transforms": content.poses.tolist()}
    grasps |= nested({name: plain(column) for name, column in columns.items()})
    whole = {"object": dict(content.object), **content.header}
    whole["grasps"] = {**whole.get("grasps", {}), **grasps}
    path.write_text(json.dumps(whole), encoding="utf-8")


def _content(text: bytes) -> Content:
    try:
        whole = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"is no whole JSON file: {error}") from error
    grasps = whole.get("grasps") if isinstance(whole, dict) else None
    if not isinstance(grasps, dict) or "transforms" not in grasps:
        raise ValueError(f"is a JSON file of something else, expected GraspGen's: {EXPECTED}")
    poses = numbers_of("grasps.transforms", grasps.pop("transforms"), "poses (n, 4, 4)")
    entries = flat(grasps)
    rows = [k for k, v in entries.items() if isinstance(v, list) and len(v) == len(poses)]
    columns = {name: column_of(entries.pop(name)) for name in rows}
    if LABEL in entries:
        raise ValueError(f"grasps.{LABEL} is not a list of {len(poses)} values, as transforms is")
    said = whole["object"] if isinstance(whole.get("object"), dict) else {}
    header, label = {**whole, "grasps": nested(entries)}, LABEL if LABEL in columns else ""
    return Content(FORMAT, poses, columns, (), said, header, label)


MEMBER = ".grasps.json"
MOST_TEXT = 2**26  # bytes of a member; lists of Python take some twenty times as much
MOST_MEMBERS = 100_000
MOST_UNPACKED = 2**32  # bytes
PACKED: Mapping[bytes, Any] = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ": lzma.open}
DAMAGED = (tarfile.TarError, EOFError, OSError, zlib.error, lzma.LZMAError)


class _Unpacked(io.RawIOBase):
    """The bytes of a file, unpacked as they are asked for.

    Raises ValueError if too many are asked for.
    """

    def __init__(self, path: Path) -> None:
        with path.open("rb") as file:
            start = file.read(6)
        opens = next((way for magic, way in PACKED.items() if start.startswith(magic)), open)
        self._file: Any = opens(path, "rb")

    def read(self, size: int = -1) -> bytes:
        if not 0 <= size <= MOST_TEXT:
            raise ValueError(f"asks for {size} bytes at once, expected at most {MOST_TEXT}")
        return bytes(self._file.read(size))

    def seek(self, to: int, whence: int = io.SEEK_SET) -> int:
        if not 0 <= to <= MOST_UNPACKED:
            raise ValueError(f"has more than {MOST_UNPACKED} bytes when it is unpacked")
        return int(self._file.seek(to, whence))

    def tell(self) -> int:
        return int(self._file.tell())

    def close(self) -> None:
        if not self.closed:
            self._file.close()
        super().close()


def is_shard(path: Path) -> bool:
    """Whether this is a tar file, as far as its first header tells."""
    try:
        with closing(_Unpacked(path)) as file:
            tarfile.TarInfo.frombuf(file.read(tarfile.BLOCKSIZE), "utf-8", "surrogateescape")
    except DAMAGED:
        return False
    return True


def member_of(path: Path, wanted: str | None) -> tuple[str, bytes]:
    """The name and the text of the member of an object; None: of the only one.

    Raises ValueError if there is none, if the file is damaged, or if it is too much.
    """
    try:
        with (
            closing(_Unpacked(path)) as unpacked,
            tarfile.open(fileobj=unpacked, mode="r:") as file,
        ):
            members: dict[str, tarfile.TarInfo] = {}
            for count, member in enumerate(file, 1):
                if count > MOST_MEMBERS:
                    raise ValueError(f"has more than {MOST_MEMBERS} members, expected grasps")
                if member.name.endswith(MEMBER):
                    members[member.name.removesuffix(MEMBER)] = member
            name = wanted if wanted is not None or len(members) != 1 else next(iter(members))
            if name not in members:
                some = ", ".join(map(repr, [*members][:3])) + " ..." * (len(members) > 3)
                way = 'expected one of them, as where={"object": NAME}'
                said = f"has {len(members)} objects ({some})"
                raise ValueError(f"{said}, and where has {name!r}; {way}")
            return name, _text(file, members[name])
    except DAMAGED as error:
        raise ValueError(f"is damaged or cut off, expected a whole tar file: {error}") from error


def _text(file: tarfile.TarFile, member: tarfile.TarInfo) -> bytes:
    if not member.isreg():
        raise ValueError(f"{member.name} is a link or a device, expected a file")
    if member.size > MOST_TEXT:
        raise ValueError(f"{member.name} has {member.size} bytes, expected at most {MOST_TEXT}")
    content = file.extractfile(member)
    return content.read() if content else b""
