"""The C++ core's rooms: each stands on those before it, and two alone know OMPL."""

import re
from collections import Counter
from pathlib import Path

import pytest

CPP = Path(__file__).parents[3] / "cpp"
ROOMS = (
    "base",
    "scene",
    "sets",
    "physics",
    "problem",
    "problem_io",
    "search",
    "quasistatic",
    "bounds",
    "metrics",
)
FILES = sorted(
    path
    for folder in (CPP / "src", CPP / "include")
    for path in folder.rglob("*.?pp")
    if path.name != "energymargin.hpp"  # includes them all
)
# Public headers without a source of their name.
HEADERS_ALONE = {
    "types": "base",
    "random": "base",
    "parallel": "base",
    "plausible": "scene",
    "policy": "scene",
    "simulator": "scene",
    "audit": "physics",
    "membership": "sets",
    "signed_distance": "sets",
    "interval": "metrics",
}
BULLET = re.compile(r"#include <(bt\w|Bullet|LinearMath)")


def room_of(path: Path) -> str:
    parts = path.relative_to(CPP).parts
    if parts[0] == "src":
        return parts[1]
    if len(parts) == 4:  # include/energymargin/search/ao.hpp
        return parts[2]
    sources = list((CPP / "src").rglob(f"{path.stem}.cpp"))
    rooms = {source.relative_to(CPP).parts[1] for source in sources} or {HEADERS_ALONE[path.stem]}
    (room,) = rooms
    return room


def included(path: Path) -> list[Path]:
    names = re.findall(r'#include "([^"]+)"', path.read_text())
    return [
        CPP / ("include" if name.startswith("energymargin/") else "src") / name for name in names
    ]


def test_a_file_includes_from_its_own_room_and_those_before_it():
    upwards = []
    for path in FILES:
        for header in included(path):
            assert header.is_file(), f"{path} includes {header}"
            if ROOMS.index(room_of(header)) > ROOMS.index(room_of(path)):
                upwards.append(f"{path.relative_to(CPP)} -> {header.relative_to(CPP)}")
    assert not upwards


def test_public_headers_include_public_ones_only():
    headers = [path for path in FILES if "include" in path.relative_to(CPP).parts[0]]
    private = [
        h for path in headers for h in included(path) if "src" in h.relative_to(CPP).parts[0]
    ]
    assert len(headers) > 20
    assert not private


@pytest.mark.parametrize("engine", ["native", "bullet"])
def test_engines_are_known_where_they_are_made_alone(engine):
    folder = CPP / "src/physics" / engine
    users = [
        p
        for p in FILES
        if folder not in p.parents and any(folder in h.parents for h in included(p))
    ]
    assert users == [CPP / "src/physics/engine.cpp"]


def test_bullet_is_in_one_room_and_ompl_in_two():
    rooms = {"Bullet": Counter(), "OMPL": Counter()}
    for path in FILES:
        text = path.read_text()
        rooms["Bullet"][room_of(path)] += bool(BULLET.search(text))
        rooms["OMPL"][room_of(path)] += "#include <ompl/" in text
    assert set(+rooms["Bullet"]) == {"physics"}
    assert set(+rooms["OMPL"]) == {"search", "quasistatic"}
