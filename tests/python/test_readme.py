import re
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)


def test_the_readme_has_examples_and_no_gap():
    assert len(EXAMPLES) == 7
    assert "TABLE" not in README.read_text()


@pytest.mark.parametrize("example", EXAMPLES)
def test_each_example_of_the_readme_runs_as_it_is_written(example, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {})
