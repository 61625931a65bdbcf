"""What tables are made of: Markdown, CSV, and numbers without the zero before the point."""

import numpy as np
import pytest
from rich.console import Console

from energymargin.base.summary import Summary
from energymargin.base.table_text import csv_text, markdown_table, short


def test_a_markdown_table_has_a_rule_below_its_header_and_lines_within_cells():
    table = markdown_table(["", "AUC"], [["push", ".981\n.97-.99"]], ["left", "right"])
    assert table == "|  | AUC |\n| --- | ---: |\n| push | .981<br>.97-.99 |"


def test_a_bar_in_a_cell_is_no_border():
    assert markdown_table(["a|b"], []) == "| a\\|b |\n| --- |"


def test_a_row_of_another_length_is_refused():
    with pytest.raises(ValueError, match=r"a row has 1 cells, expected 2: \['push'\]"):
        markdown_table(["", "AUC"], [["push"]])


def test_csv_has_all_digits_and_quotes_what_needs_it():
    text = csv_text(("score", "auc"), [("effort, est", 1 / 3), ("capture", "")])
    assert text == f'score,auc\n"effort, est",{1 / 3!r}\ncapture,\n'


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [
        (0.9814, 3, ".981"),
        (0.9994, 3, ".999"),
        (0.9995, 3, "1.00"),
        (1.0, 2, "1.00"),
        (0.0, 3, ".000"),
        (np.float64(0.5), 2, ".50"),
    ],
)
def test_a_share_is_short(value, decimals, text):
    assert short(value, decimals) == text


def test_a_wide_table_of_80_columns_breaks_long_texts_and_keeps_ranks_and_numbers(capsys):
    head = ("rank", "grasp", "holds", "95 % interval", "for", "lost", "colliding", "effort [J]")
    numbers = ("1.00", "0.40 to 1.00", "1.5 s")
    rows = [
        (
            rank,
            f"a grasp of the mug at its handle, {rank}",
            *numbers,
            "3 slipped, 2 not gripped",
            "3",
            "0.0123",
        )
        for rank in (1, 2, 12)
    ]
    Console(width=80).print(Summary("grasps", rows, head))
    lines = capsys.readouterr().out.splitlines()
    (names,) = (line for line in lines if line.startswith("rank"))
    assert names.split() == " ".join(head).split()
    kept = [line for line in lines if line[:1].isdigit()]
    assert [line.split()[0] for line in kept] == ["1", "2", "12"]
    assert all(cell in line for line in kept for cell in (*numbers, "0.0123"))
