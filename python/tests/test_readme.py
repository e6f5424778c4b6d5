"""The examples of the README run."""

import re
from pathlib import Path

import shapespace

README = Path(__file__).parent.parent / "README.md"


def test_the_first_example(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    assert len(blocks) == 1
    # On a coarse grid.
    names = {}
    exec(blocks[0].replace("65", "33"), names)
    assert names["average"].mask.any() and (tmp_path / "ellipses/result.json").is_file()
    # What one sees first should not be doubtful.
    assert names["average"].verdict == names["modes"].verdict == "sound"


def test_every_function_is_described():
    text = README.read_text()
    functions = [name for name in shapespace.__all__ if name[0].islower()]
    assert all(f"`{name}(" in text or f"shapespace.{name}(" in text for name in functions)
