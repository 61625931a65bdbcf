"""Public names of Python as Markdown: signatures, docstrings, fields, values."""

from __future__ import annotations

import importlib
import inspect
import re
import textwrap
from collections.abc import Iterable, Iterator
from types import ModuleType
from typing import Any

from sphinx.pycode import ModuleAnalyzer
from sphinx.util.inspect import signature, stringify_signature

from reference_headers import prose

WIDTH = 100  # of a signature
LONGEST = 100  # characters of a value
MADE_BY_PYTHON = ("Create new instance of ", "Alias for field number ", "Initialize self.")
OF_OTHERS = re.compile(
    r"\b(energymargin\._core|collections\.abc|numpy\.typing|numpy|typing|pathlib|searches)\."
    r"|\benergymargin\.(?:\w+\.)*(?=[A-Z])"
)
ALIASES = {"AnyPath": "str | os.PathLike[str]", "Floats": "NDArray[float64]"}  # base/aliases.py
ARRAY = re.compile(r"(?:numpy\.)?ndarray\[.*?dtype\[(.*?)\]\]")
ARRAY_LIKE = re.compile(r"[~\w.]*_Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]")
SECTION = re.compile(r"^(Args|Raises|Returns|Yields|Example|Examples):$")
ARGUMENT = re.compile(r"^( *)(\*{0,2}\w+): (.*)")


def of_names(module: str, names: Iterable[str], level: int) -> str:
    """Some names of a module, a section each."""
    inside = importlib.import_module(module)
    return "\n".join(section(name, getattr(inside, name), inside, level) for name in names)


def of_module(module: str, left_out: Iterable[str], level: int) -> str:
    """A module's docstring, what it has, and a table of its values."""
    inside = importlib.import_module(module)
    names = getattr(inside, "__all__", None) or [
        name for name, thing in vars(inside).items() if getattr(thing, "__module__", "") == module
    ]
    public = {n: getattr(inside, n) for n in names if n not in left_out and n[0] != "_"}
    things = {name: thing for name, thing in public.items() if has_docstring(thing)}
    parts = [markdown(inspect.getdoc(inside) or ""), ""]
    parts += [section(name, thing, inside, level) for name, thing in things.items()]
    values = {name: value for name, value in public.items() if name not in things}
    rows = [f"| `{name}` | {_cell(f'`{written(v)}`')} |" for name, v in values.items()]
    return "\n".join([*parts, *(["| value | |", "| --- | --- |", *rows, ""] if rows else [])])


def has_docstring(thing: object) -> bool:
    """Whether a thing is described by itself, and not by its value."""
    return inspect.isclass(thing) or inspect.isroutine(thing) or inspect.ismodule(thing)


def written(value: object) -> str:
    """A value as Python writes it, shortened."""
    text = _short(repr(value)).replace("`", "'")
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."


def section(name: str, thing: Any, module: ModuleType, level: int) -> str:
    """A function or a class under a heading."""
    path = module.__name__.replace("energymargin", "em", 1) if _is_short(module) else ""
    shown = f"{path}.{name}" if path else name
    lines = [f"{'#' * level} {shown}", ""]
    if inspect.isclass(thing):
        return "\n".join([*lines, *_class(shown, thing)])
    return "\n".join([*lines, *_function(shown, thing)])


def _is_short(module: ModuleType) -> bool:
    return module.__name__.count(".") < 2 and module.__name__.startswith("energymargin")


def _class(name: str, kind: type) -> Iterator[str]:
    signatures, made = _doc(vars(kind).get("__init__"), kind.__name__)
    about = inspect.getdoc(kind) or ""
    constructor = vars(kind).get("__init__")
    if not signatures and constructor and inspect.isfunction(inspect.unwrap(constructor)):
        signatures = [_signature(kind).removesuffix(" -> None")]
    yield from _code(name, [] if issubclass(kind, BaseException) else signatures)
    yield from (markdown("" if about.startswith(MADE_BY_PYTHON) else about, signatures), "")
    if made not in ("", "See the class.", about) and not made.startswith(MADE_BY_PYTHON):
        yield from (markdown(made, signatures), "")
    fields = dict(_fields(kind))
    if fields:
        rows = [f"| `{each}` | {_cell(markdown(text, ()))} |" for each, text in fields.items()]
        yield from ("| | |", "| --- | --- |", *rows, "")
    for each, member in vars(kind).items():
        if each in fields or (each.startswith("_") and each != "__call__"):
            continue
        function = getattr(member, "__func__", member)
        if _is_function(function):
            yield from _function(f".{each}", function)


def _is_function(thing: object) -> bool:
    return inspect.isroutine(thing) and callable(thing)  # a cached property is no function


def _fields(kind: type) -> Iterator[tuple[str, str]]:
    """Fields, properties and values of a class, each with what it is."""
    try:
        told = ModuleAnalyzer.for_module(kind.__module__).find_attr_docs()
    except Exception:  # a compiled module has no source
        told = {}
    names = [*inspect.get_annotations(kind), *vars(kind)]
    for name in dict.fromkeys(name for name in names if not name.startswith("_")):
        member = vars(kind).get(name)
        if _is_function(getattr(member, "__func__", member)):
            continue
        lines = told.get((kind.__qualname__, name)) or [inspect.getdoc(member) or ""]
        text = " ".join(lines)
        plain = isinstance(member, (int, float, str, tuple, dict, frozenset, type(None)))
        has_own = told.get((kind.__qualname__, name)) or not plain
        yield name, text if has_own and not text.startswith(MADE_BY_PYTHON) else ""


def _function(name: str, function: Any) -> Iterator[str]:
    signatures, about = _doc(function, name.rpartition(".")[2])
    signatures = signatures or [_signature(function)]
    yield from _code(name, signatures)
    yield from (markdown(about, signatures), "")


def _doc(function: Any, name: str) -> tuple[list[str], str]:
    """Signatures that a compiled function's docstring begins with, and what comes below."""
    text = inspect.getdoc(function) or ""
    found = re.match(rf"(?:{name}|__init__)(\(.*\)(?: -> .*)?)\n?", text)
    if not found or inspect.isfunction(inspect.unwrap(function)):
        return [], text
    return [_short(found[1]).replace(" -> None", "")], text[found.end() :].strip()


def _signature(thing: Any) -> str:
    return _short(stringify_signature(signature(thing), unqualified_typehints=True))


def _short(text: str) -> str:
    """A signature with the names that a reader knows."""
    text = re.sub(r"^\((?:self|cls)(?:: [\w.]+)?(?:, )?", "(", ARRAY_LIKE.sub("ArrayLike", text))
    text = ARRAY.sub(lambda found: f"NDArray[{found[1].removeprefix('numpy.')}]", text)
    text = re.sub(r"<([\w.]+) object at 0x[0-9a-f]+>", r"\1()", text)
    text = re.sub(r"<function (\w+) at 0x[0-9a-f]+>", r"\1", text)
    for alias, meaning in ALIASES.items():
        text = re.sub(rf"\b{alias}\b", meaning, text)
    return OF_OTHERS.sub("", text).replace("~", "")


def _code(name: str, signatures: list[str]) -> list[str]:
    lines = (  # a line ends after a comma
        re.sub(r"(?<!,) ", "\0", f"{name}{one}") for one in signatures
    )
    wrapped = (
        textwrap.fill(line, WIDTH, subsequent_indent="    ", break_long_words=False)
        for line in lines
    )
    return ["```python", *(w.replace("\0", " ") for w in wrapped), "```", ""] if signatures else []


def markdown(text: str, signatures: Iterable[str] = ()) -> str:
    """A docstring as Markdown: its arguments are a list, and nothing is markup by chance."""
    arguments = set(re.findall(r"(\w+)(?=: |=|,|\))", " ".join(signatures)))
    lines: list[str] = []
    fenced, section, indent = False, "", 0
    for line in text.splitlines():
        if line.lstrip().startswith("```") or fenced:
            fenced ^= line.lstrip().startswith("```")
            lines.append(line.strip() if line.lstrip().startswith("```") else line)
            continue
        if head := SECTION.match(line):
            section, indent = head[1], 4
            lines += ["" if section == "Args" else f"{section}:", ""]
            continue
        if line and not line.startswith(" "):
            section = ""
        found = ARGUMENT.match(line)
        if found and ((section and len(found[1]) == indent) or found[2] in arguments):
            lines.append(f"- `{found[2]}`: {prose(found[3])}")
        elif section and line.strip():
            lines.append(f"  {prose(line.strip())}")
        else:
            lines.append(re.match(" *", line)[0] + prose(line.strip()))  # type: ignore[index]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip()


def _cell(text: str) -> str:
    return " ".join(re.sub(r"(?<!\\)\|", r"\\|", text).split())
