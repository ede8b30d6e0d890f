"""What a bench cannot do is refused before anything starts, in one line that names the value."""

from pathlib import Path

import pytest

from bench.app.cli.main import main


def _refused(capsys: pytest.CaptureFixture[str], folder: Path, *flags: str) -> str:
    code = main(["run", "harmonic", "--yes", "--out", str(folder), *flags])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    # what takes long is announced before it is refused; the refusal is one line, the last
    *announced, refusal = captured.err.splitlines()
    assert refusal.startswith("rockbench: error: ")
    assert not any("error" in line for line in announced)
    assert not folder.exists()
    return refusal


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--omega", "0"), ("omega", "0", "above 0")),
        (("--omega", "3"), ("omega", "3", "165.1 mm", "60.0 mm")),
        (("--omega", "5", "--amplitude-factor", "2.4"), ("omega", "141.3 mm")),
        (("--omega", "6.3"), ("omega", "6.3", "storey 1 of the bare frame", "100 mm")),
        (("--omega", "16", "--settle-limit", "5"), ("settle_limit", "9.4 s")),
        (("--omega", "16", "16"), ("omega", "once")),
        (("--beta", "-0.4"), ("beta", "-0.4", "above 0")),
        (("--amplitude-factor", "5"), ("amplitude_factor", "7.36 m/s2", "limits.acceleration")),
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
        ("[specimen.frame]\nk1 = 1e300\n", ("k1", "1e+300", "rad/s")),
        ("[specimen.frame]\nh1 = 0.6\n", ("h1", "0.6", "height of the second storey")),
        ("[specimen.block]\nrestitution_factor = 1.5\n", ("restitution_factor", "1.5", "outside 0 to 1")),
        ("[specimen]\nbeta = 3.0\n", ("specimen.beta", "protocol")),
        ("[simulation.specimen]\nbeta = 3.0\n", ("simulation.specimen.beta", "spring_factor")),
        ('[simulation.bench.laser_1]\nreference = "table"\n', ("laser_2.reference", "both lasers")),
        ("[ramps]\nabort = 9.0\n", ("ramps", "abort must not be longer than stop")),
        ("omega = " + 3000 * "[", ("nested",)),
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
