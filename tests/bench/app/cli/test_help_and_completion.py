"""Every help ends with an example that parses; shells complete commands and options."""

import os
import shlex
import shutil
import subprocess
from collections.abc import Generator
from contextlib import redirect_stdout
from functools import cache
from inspect import getdoc, getsource
from io import FileIO, StringIO, TextIOWrapper
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import pytest
from cyclopts import App

from bench.app.cli.main import COMMANDS as TREE
from bench.app.cli.main import main, rockbench_app
from tests.command_line import commands

Said = pytest.CaptureFixture[str]
APP = rockbench_app()
COMMANDS = [path for path, _ in commands(APP)]


@pytest.fixture(scope="module", autouse=True)
def _made_once() -> Generator[None]:
    """The script of a shell, which takes half a second, and the source of each class of options, which cyclopts looks
    up for every command anew.
    """
    generate, scripts = App.generate_completion, dict[str, str]()

    def generated(app: App, *, shell: Any) -> str:
        if shell not in scripts:
            scripts[shell] = generate(app, shell=shell)
        return scripts[shell]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(App, "generate_completion", generated)
        patch.setattr("docstring_parser.attrdoc.inspect.getsource", cache(getsource))
        yield


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_the_help_of_every_command_ends_with_an_example_that_parses(
    path: tuple[str, ...], capsys: Said, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main([*path, "--help"]) == 0
    *_, last = capsys.readouterr().out.rstrip().splitlines()
    words = shlex.split(last)
    assert words[:2] == ["Example:", "rockbench"]
    assert tuple(words[2 : 2 + len(path)]) == path
    # raises for what it does not know
    command, bound, _ = APP.parse_args(words[2:], exit_on_error=False, print_error=False)
    # a group of commands alone would only print its help
    assert command.__module__.startswith("bench.app.cli")
    assert bound.arguments


@pytest.mark.parametrize("path", [path for path in TREE if path != "check"])
def test_the_summary_of_a_command_is_the_first_paragraph_of_its_documentation(path: str) -> None:
    target, summary, _ = TREE[path]
    function = resolve_name(f"bench.app.cli.{target}")
    assert " ".join(getdoc(function).split("\n\n")[0].split()) == summary  # pyright: ignore[reportOptionalMemberAccess]


@pytest.mark.parametrize("path", ["analyse", "benchmark", "check", "gui", "records fit"])
def test_the_help_of_a_command_has_its_whole_documentation_without_hard_line_breaks(
    path: str, capsys: Said, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "2000")
    assert main([*path.split(), "--help"]) == 0
    summary, *rest = capsys.readouterr().out.split("\n\n")[1:]
    assert "\n" not in summary.strip()
    assert "\n" not in rest[0].strip()
    assert len(rest[0]) > 100


def _completed(script: Path, typed: str) -> set[str]:
    """What bash offers after `typed`."""
    words = typed.split(" ")
    quoted = " ".join(shlex.quote(word) for word in words)
    code = (
        f"source {shlex.quote(str(script))}; COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}; "
        "complete -p rockbench >/dev/null && $(complete -p rockbench | sed 's/.*-F \\([^ ]*\\).*/\\1/'); "
        'printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(["bash", "--norc", "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return {line.strip() for line in done.stdout.splitlines()}


def _script(shell: str) -> str:
    """What `completion` prints."""
    with redirect_stdout(StringIO()) as out:
        assert main(["completion", shell]) == 0
    return out.getvalue()


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_commands_and_options(tmp_path: Path) -> None:
    script = tmp_path / "rockbench.bash"
    script.write_text(_script("bash"), encoding="utf-8")
    assert _completed(script, "rockbench pre") == {"predict"}
    assert {"harmonic", "earthquake", "identify"} <= _completed(script, "rockbench run ")
    assert _completed(script, "rockbench run harmonic --amplitude-f") == {"--amplitude-factor"}
    assert {"mat", "csv", "uff", "parquet"} == _completed(script, "rockbench export a.h5 --to ")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell"])
def test_a_script_is_made_for_every_shell_and_passes_its_parser(shell: str) -> None:
    script = _script(shell)
    for path in COMMANDS:
        assert all(word in script for word in path)
    program = "pwsh" if shell == "powershell" else shell
    if shell != "powershell" and shutil.which(program) is not None:
        checked = subprocess.run([program, "-n"], input=script, capture_output=True, text=True, check=False)
        assert (checked.returncode, checked.stderr) == (0, "")


@pytest.mark.parametrize(
    ("shell", "place"),
    [
        ("bash", ".local/share/bash-completion/completions/rockbench"),
        pytest.param("zsh", ".zsh/completions/_cyclopts_rockbench", marks=pytest.mark.soak),
        pytest.param("fish", ".config/fish/completions/rockbench.fish", marks=pytest.mark.soak),
    ],
)
def test_installing_puts_the_script_where_the_shell_looks(
    shell: str, place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    for name in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(name, str(tmp_path))
    for name in ("ZSH_CUSTOM", "ZSH", "XDG_CONFIG_HOME", "XDG_DATA_HOME"):
        monkeypatch.delenv(name, raising=False)
    assert main(["completion", shell, "--install"]) == 0
    assert "rockbench" in (tmp_path / place).read_text(encoding="utf-8")
    assert place.rpartition("/")[2] in capsys.readouterr().out


def test_a_home_that_cannot_be_written_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    file = tmp_path / "file"
    file.touch()
    for name in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(name, str(file))
    assert main(["completion", "fish", "--install"]) == 2
    assert capsys.readouterr().err.startswith("rockbench: error: --install = ")


def test_a_reader_that_has_closed_the_pipe_is_not_a_file_that_cannot_be_written(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with FileIO(writer, "w") as raw:
        monkeypatch.setattr("sys.stdout", TextIOWrapper(raw, encoding="utf-8", write_through=True))
        with pytest.raises(BrokenPipeError):
            main(["completion", "bash"])
