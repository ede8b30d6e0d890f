"""Text files that are nested too deeply or too large are refused."""

import json
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from bench.app.queue.file import QueueFile
from bench.bounded import DEEPEST, LARGEST, require_shallow
from bench.config.result_files import read_specimen
from bench.config.toml import read_table
from bench.control.table_model import TableModel
from sim.errors import InvalidInput

READERS: dict[str, Callable[[Path], object]] = {
    "toml": lambda path: read_table(path, "configuration"),
    "specimen": read_specimen,
    "queue": lambda path: QueueFile(path).read(),
    "table model": TableModel.read,
}
DEEP = {
    "lists": "[" * 100 + "]" * 100,
    "tables": '{"a":' * 100 + "1" + "}" * 100,
    "too deep for the parser": "[" * 100_000,
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", DEEP)
@pytest.mark.seconds
def test_deep_nesting_is_refused_soon(reader: str, kind: str, tmp_path: Path) -> None:
    path, text = tmp_path / "file", DEEP[kind]
    path.write_text(f"a = {text.replace(':', '=')}\n" if reader == "toml" else text, encoding="utf-8")
    begun = time.process_time()
    with pytest.raises(InvalidInput):
        READERS[reader](path)
    assert time.process_time() - begun < 2.0


@pytest.mark.parametrize("reader", READERS)
def test_a_file_beyond_all_measure_is_refused_before_it_is_read(reader: str, tmp_path: Path) -> None:
    path = tmp_path / "file"
    with path.open("wb") as file:
        file.truncate(10 * LARGEST)
    with pytest.raises(InvalidInput, match="MB"):
        READERS[reader](path)


def test_what_a_configuration_needs_is_shallow() -> None:
    require_shallow({"a": [{"b": [1, 2]}]})
    deep = json.loads("[" * DEEPEST + "]" * DEEPEST)
    require_shallow(deep)
    with pytest.raises(ValueError, match="deeper"):
        require_shallow([deep])
