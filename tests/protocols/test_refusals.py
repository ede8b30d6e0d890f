"""What a bench cannot do is refused before anything starts, in one line that names the value."""

from pathlib import Path

import pytest

from bench.cli.main import main


def _refused(capsys: pytest.CaptureFixture[str], folder: Path, *flags: str) -> str:
    code = main(["run", "harmonic", "--yes", "--out", str(folder), *flags])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert captured.err.startswith("rockbench: error: ")
    assert captured.err.count("\n") == 1
    assert not folder.exists()
    return captured.err


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--omega", "0"), ("omega", "0", "above 0")),
        (("--omega", "3"), ("omega", "3", "137.6 mm", "60.0 mm")),
        (("--omega", "5", "--amplitude-factor", "2.4"), ("omega", "117.7 mm")),
        (("--omega", "16", "16"), ("omega", "once")),
        (("--beta", "-0.4"), ("beta", "-0.4", "above 0")),
        (("--amplitude-factor", "5"), ("amplitude_factor", "6.13 m/s2", "limits.acceleration")),
        (("--starts", "0"), ("starts", "0", "at least 1")),
        (("--frequency", "16"), ("--frequency",)),
    ],
)
def test_bad_flags(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, flags: tuple[str, ...], words: tuple[str, ...]
) -> None:
    message = _refused(capsys, tmp_path / "run", *flags)
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[specimen.frame]\nk1 = -213.0\n", ("specimen.frame.k1", "-213", "above 0")),
        ("[specimen.frame]\nk_1 = 213.0\n", ("specimen.frame.k_1", "k1")),
        ("[limits]\nvelocity = 0.05\n", ("omega", "limits.velocity = 0.05")),
        ("[simulation.bench.filter_unit]\ncutoff = 5000.0\n", ("cutoff", "5000")),
        ("[specimen\n", ("line 1",)),
    ],
)
def test_bad_configurations(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, text: str, words: tuple[str, ...]
) -> None:
    configuration = tmp_path / "bench.toml"
    configuration.write_text(text, encoding="utf-8")
    message = _refused(capsys, tmp_path / "run", "--config", str(configuration))
    for word in words:
        assert word in message
