"""Code lines of each Python package: `python tools/code_lines.py [--markdown]`.

No blank line, comment or docstring (of an attribute too) counts. A statement that spans several
lines counts as many.
"""

from __future__ import annotations

import argparse
import ast
import io
import tokenize
from collections import Counter
from pathlib import Path

PYTHON = Path(__file__).parent.parent / "python"
PRODUCTS = {"product": "energymargin", "studies": "energymargin_paper", "benchmarks": "bench"}
NOT_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}


def code_lines(text: str) -> int:
    """Number of lines of a Python source that hold code."""
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in NOT_CODE:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            lines.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(lines)


def by_package(folder: Path) -> dict[str, tuple[int, int]]:
    """Files and code lines of each package in a folder; those beside the packages are `(root)`."""
    files: Counter[str] = Counter()
    lines: Counter[str] = Counter()
    for path in sorted(folder.rglob("*.py")):
        inside = path.relative_to(folder).parts
        package = inside[0] if len(inside) > 1 else "(root)"
        files[package] += 1
        lines[package] += code_lines(path.read_text())
    return {package: (files[package], lines[package]) for package in sorted(lines)}


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--markdown", action="store_true", help="a table for a page")
    row = "| {:<24} | {:>5} | {:>10} |" if parser.parse_args().markdown else "{:<24} {:>5} {:>10}"
    print(row.format("package", "files", "code lines"))
    if row.startswith("|"):
        print("| --- | ---: | ---: |")
    for name, folder in PRODUCTS.items():
        packages = by_package(PYTHON / folder)
        for package, (files, lines) in packages.items():
            print(row.format(f"{folder}/{package}", files, f"{lines:,}"))
        files, lines = (sum(column) for column in zip(*packages.values(), strict=True))
        print(row.format(f"the {name}", files, f"{lines:,}"))


if __name__ == "__main__":
    main()
