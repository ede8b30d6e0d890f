"""A thousand slips of a person's hand, each put where a person types it, and what becomes of it.

`python -m tests.slips [COUNT] [SEED]` prints what was refused, what was accepted with a notice, and what was accepted
in silence, which is none. Every numeric key of the configuration and every numeric option of every command takes part;
nothing is run: files are read and flags validated as the commands do.
"""

import contextlib
import io
import random
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from math import isclose, pi, sqrt
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import tomlkit

from bench.accelerograms.reference import RecordReference, seconds_of
from bench.app.catalogue import all_protocols
from bench.app.cli.emulate import _at_rate, _ratios
from bench.app.cli.inputs import configuration_from, parameters_from, request_from, specimen_from
from bench.app.cli.main import main as command_line
from bench.app.cli.replay import _clock
from bench.config.declared import Declared, at, declared, flag
from bench.config.model import BenchConfiguration
from bench.config.review import review
from bench.config.toml import problems_of, read_configuration
from bench.config.usual import notices_of, specimen_notices
from bench.prediction import requests
from bench.prediction.seismic import band_of
from sim.errors import InvalidInput
from sim.parameters import Parameters
from sim.specimen import Specimen

SPREAD = 1.5
"""What was meant lies within this factor of the default or of a typical value."""
ANGLES = ("rad/s", "rad")
CYCLES = ("rad/s", "Hz", "rad", "N/m")
PREDICTIONS: tuple[type[Parameters], ...] = (
    requests.ModesRequest,
    requests.SteadyRequest,
    requests.SpectrumRequest,
    requests.MapRequest,
    requests.HistoryRequest,
    requests.SeismicRequest,
    requests.BandStudyRequest,
    requests.StrokeFitRequest,
)
TYPICAL: dict[str, Any] = {
    # what a person gives where there is neither a default nor an example
    "specimen.springs.label": 0.25,
    "specimen.springs.k_c": 53.36,
    "identified.findings.value": 213.0,
    "identified.findings.standard_uncertainty": 1.0,
    "identified.correlations.coefficient": 0.5,
    "calibrated.valid_days": 365.0,
    "calibrated.laser.lowest": -0.05,
    "calibrated.laser.highest": 0.05,
    "calibrated.laser.rest": 0.0002,
    "calibrated.laser.error": 1e-5,
    "calibrated.laser.uncertainty": 2e-5,
    "calibrated.laser.delay": 0.002,
    "calibrated.laser.delay_uncertainty": 1e-5,
    "calibrated.common_linearity": 5e-5,
    "identify.band_low": 0.5,
    "identify.band_high": 25.0,
    "free-vibration.pulse": 0.3,
    "free-vibration.window": 40.0,
    "coupling-stiffness.pulse": 0.3,
    "coupling-stiffness.window": 40.0,
}
LASER = {
    "sensor": "1",
    "lowest": -0.05,
    "highest": 0.05,
    "rest": 0.0002,
    "error": [1e-5, 2e-5],
    "uncertainty": 2e-5,
    "scale": 1.0,
    "delay": 0.002,
    "delay_uncertainty": 1e-5,
}
COMPANY: dict[str, dict[str, Any]] = {
    # what must stand in the file beside a key
    "calibrated": {
        "date": "2026-01-01T00:00:00Z",
        "valid_days": 365.0,
        "laser_1": LASER,
        "laser_2": LASER,
        "differential_scale": 1.0,
        "differential_uncertainty": 1e-3,
        "common_linearity": 5e-5,
        "table_displacement": 1.0,
        "table_acceleration": 1.0,
        "table_uncertainty": 1e-3,
    },
}
CHANNEL = {
    "name": "storey_2_acceleration",
    "measures": "acceleration",
    "unit": "m/s2",
    "place": "storey 2",
    "sensitivity": 0.1,
    "limit": 20.0,
}
FINDING = {"value": 213.0, "standard_uncertainty": 1.0, "source": "a test", "date": "2026-01-01T00:00:00Z"}
FINDINGS = [{"name": "k1", **FINDING}, {"name": "k2", **FINDING, "value": 56.0}]


@dataclass(frozen=True)
class Outcome:
    """How an entry was answered: what refused it, else the notices that it caused."""

    refusal: str | None
    notices: tuple[str, ...] = ()


@dataclass(frozen=True)
class Slip:
    """What was typed at a place, the kind of slip, and who answers; `said` are words that the answer must hold."""

    place: str
    typed: str
    kind: str
    answer: Callable[[], Outcome]
    said: tuple[str, ...] = ()


def slips(seed: int) -> Iterator[Slip]:
    """Every slip of the kinds below; what was meant is the default or typical value times a random factor."""
    meant = random.Random(seed)
    yield from _in_configuration(meant)
    yield from _in_protocols(meant)
    yield from _in_predictions(meant)
    yield from _elsewhere(meant)


def _variants(entry: Declared, values: Sequence[float], meant: random.Random) -> Iterator[tuple[str, list[str]]]:
    """(kind, tokens) for each slip of a value, or of all values of a list."""
    whole, value = entry.kind is int, values[0]
    text = f"{value:g}"
    if whole:
        yield "comma", [f"{text},5"]
    else:
        yield (
            "comma",
            [
                text.replace(".", ",")
                if "." in text and "e" not in text
                else f"{abs(value) + 0.5:.1f}".replace(".", ",")
            ],
        )
    yield "thousands comma", ["1,000"]
    for name, text in (("not a number", "nan"), ("infinite", "-inf"), ("hexadecimal", "0x1F"), ("underscore", "1_0")):
        yield name, [text]
    if len(values) > 1 or entry.many:
        yield "list by commas", ["0.25,0.64"]
        yield "reversed range", ["21:12:4"]
        yield "range of zero values", ["12:21:0"]
    if entry.unit in ("", "1"):
        return
    for kind, factor in (("1000", 1000.0), ("2 pi", 2.0 * pi), ("degrees", 180.0 / pi)):
        if (kind == "2 pi" and entry.unit not in CYCLES) or (kind == "degrees" and entry.unit not in ANGLES):
            continue
        for sign, times in (("times", factor), ("over", 1.0 / factor)):
            off = times * meant.uniform(1.0 / SPREAD, SPREAD)
            yield (
                f"{sign} {kind}",
                [f"{round(each * off)}" if whole and each * off >= 1 else f"{each * off:.6g}" for each in values],
            )


def _typical(key: str, entry: Declared) -> list[float]:
    """What a person means to give; of a long list its ends and some between."""
    if key in TYPICAL:
        return [TYPICAL[key]]
    if entry.many and entry.default:
        return [float(each) for each in entry.default[:: max(1, len(entry.default) // 5)]]
    for value in (entry.default, entry.example):
        if isinstance(value, float | int) and not isinstance(value, bool) and value != 0:
            return [float(value)]
    if entry.usual is not None:
        return [float(f"{sqrt(entry.usual[0] * entry.usual[1]):.3g}")]
    return [0.5]


def _in_configuration(meant: random.Random) -> Iterator[Slip]:
    for path, entry in _numeric(BenchConfiguration, ()):
        key = ".".join(str(part) for part in path if part != 0).replace("laser_1", "laser").replace("laser_2", "laser")
        values = _typical(key.removeprefix("simulation.") if key not in TYPICAL else key, entry)
        for kind, (text, *_) in _variants(entry, values, meant):
            raw = f"[{text}, {text}]" if entry.many else text
            yield Slip(f"config {'.'.join(map(str, path))}", text, kind, partial(_checked, path, raw), (str(path[-1]),))
        name = str(path[-1])
        typo = name[:-1] + name[-1] * 2 if len(name) < 4 else name[0] + name[2] + name[1] + name[3:]
        if typo == name:
            typo = name + "x"
        wrong = (*path[:-1], typo)
        said = ("nearest", name) if len(name) > 2 else ("there is no such key",)
        place = f"config {'.'.join(map(str, path))}"
        yield Slip(place, typo, "typo of a key", partial(_checked, wrong, "1.0"), said)


def _numeric(model: type[Parameters], path: tuple[str | int, ...]) -> Iterator[tuple[tuple[str | int, ...], Declared]]:
    for entry in declared(model):
        if entry.element is not None:
            yield from _numeric(entry.element, (*path, entry.name, *((0,) if entry.many else ())))
        elif entry.kind in (int, float):
            yield (*path, entry.name), entry


def _checked(path: tuple[str | int, ...], raw: str) -> Outcome:
    """What `rockbench config check` says of a file with this key."""
    data: dict[str, Any] = {"backend": "hardware"} if path[0] == "hardware" else {}
    place: Any = data
    for part, following in zip(path, (*path[1:], None), strict=True):
        if following is None:
            place[part] = "@value@"
            break
        if isinstance(part, int):
            place = place[part]
            continue
        empty: Any = [{}] if isinstance(following, int) else {}
        if part == "findings":
            empty = [dict(FINDINGS[0]), dict(FINDINGS[1])]
        elif part == "correlations":
            data["identified"]["findings"] = FINDINGS
            empty = [{"first": "k1", "second": "k2"}]
        elif part == "channels":
            empty = [dict(CHANNEL)]
        elif part == "springs":
            empty = [{"label": 0.25, "k_c": 53.36}]
        place[part] = _copied(COMPANY[part]) if part in COMPANY else place.get(part, empty)
        place = place[part]
    text = tomlkit.dumps(data).replace('"@value@"', raw)
    with TemporaryDirectory() as folder:
        file = Path(folder, "bench.toml")
        file.write_text(text, encoding="utf-8")
        try:
            problems = problems_of(file)
        except InvalidInput as refusal:
            return Outcome(str(refusal))
        if problems:
            return Outcome("; ".join(map(str, problems)))
        return Outcome(None, review(read_configuration(file)).notices)


def _copied(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _copied(value) for key, value in data.items()}
    return [_copied(each) for each in data] if isinstance(data, list) else data


def _in_protocols(meant: random.Random) -> Iterator[Slip]:
    for each in all_protocols()[0]:
        for entry in declared(each.parameters):
            if entry.kind not in (int, float):
                continue
            for kind, tokens in _variants(entry, _typical(f"{each.name}.{entry.name}", entry), meant):
                answer = partial(_asked, each, entry.name, tokens if entry.many else tokens[0])
                place = f"run {each.name} {flag(entry.name)}"
                yield Slip(place, " ".join(tokens), kind, answer, (entry.name.replace("_", "-"),))
            yield _typo_of_option(("run", each.name) if each.name != "check" else ("check",), entry, f"run {each.name}")


def _asked(entry: Any, name: str, typed: str | list[str]) -> Outcome:
    """What `rockbench run` says of a flag before it plans."""
    parameters: Parameters = parameters_from(entry.parameters, {name: typed}, None)
    return Outcome(None, notices_of(parameters, Specimen()))


def _in_predictions(meant: random.Random) -> Iterator[Slip]:
    for model in PREDICTIONS:
        name = model.__name__.removesuffix("Request").lower()
        for entry in declared(model):
            if entry.kind not in (int, float):
                continue
            for kind, tokens in _variants(entry, _typical(f"{name}.{entry.name}", entry), meant):
                answer = partial(_requested, model, entry.name, tokens if entry.many else tokens[0])
                place = f"predict {name} {flag(entry.name)}"
                yield Slip(place, " ".join(tokens), kind, answer, (entry.name.replace("_", "-"),))
            command = {"bandstudy": ("predict", "band-study"), "strokefit": ("records", "fit", "x")}
            yield _typo_of_option(command.get(name, ("predict", name)), entry, f"predict {name}")


def _requested(model: type[Parameters], name: str, typed: str | list[str]) -> Outcome:
    request = request_from(model, {name: typed})
    return Outcome(None, notices_of(request, Specimen()))


def _typo_of_option(command: Sequence[str], entry: Declared, place: str = "") -> Slip:
    name = flag(entry.name)
    typo = name[:3] + name[4] + name[3] + name[5:] if len(name) > 5 and name[3] != name[4] else f"{name}x"
    answer = partial(_commanded, [*command, typo, "1"])
    return Slip(f"{place or ' '.join(command)} {name}", typo, "typo of an option", answer, (name,))


def _commanded(arguments: list[str]) -> Outcome:
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        code = command_line(arguments)
    return Outcome(said.getvalue() if code == 2 else None)


def _elsewhere(meant: random.Random) -> Iterator[Slip]:
    """Options that are no parameter of a protocol or a prediction, and the numbers within texts."""
    spots: list[tuple[str, Declared | None, float, Callable[[str], Any]]] = [
        ("--seed", _declared("simulation.seed"), 7.0, lambda text: configuration_from(None, text)),
        ("--sample-rate", _declared("simulation.bench.sample_rate"), 2000.0, _rated),
        ("--clock-error", _declared("simulation.bench.laser_1.clock_error"), 12e-6, lambda text: _ratios((text,) * 3)),
        ("--speed", None, 10.0, _clock),
        ("--dt", _declared("acquisition.lead"), 0.005, lambda text: seconds_of("--dt", text)),
        ("--distance", _declared("specimen.d"), 0.1, lambda text: _specimen(text, None)),
        ("--restitution-factor", _declared("specimen.block.restitution_factor"), 0.99, lambda t: _specimen(None, t)),
        ("dt", _declared("acquisition.lead"), 0.02, lambda text: RecordReference.parse(f"a.txt@unit=g,dt={text}")),
    ]
    for place, entry, value, read in spots:
        for kind, (text, *_) in _variants(entry or _declared("limits.laser_range"), [value], meant):
            yield Slip(place, text, kind, partial(_read, read, text), (place.strip("-").split("-")[0][0],))
    for kind, text in (("comma", "1,5:25"), ("reversed range", "25:1.5"), ("not a number", "nan:25")):
        yield Slip(
            "--table-band", text, kind, partial(_read, lambda t: band_of(t, BenchConfiguration()), text), ("band",)
        )


def _declared(key: str) -> Declared:
    found = at(BenchConfiguration, key.split("."))
    if found is None:
        raise KeyError(key)
    return found


def _rated(text: str) -> tuple[str, ...]:
    return review(_at_rate(BenchConfiguration(), text)).notices


def _specimen(distance: str | None, restitution: str | None) -> tuple[str, ...]:
    return tuple(specimen_notices(specimen_from(None, distance, restitution)))


def _read(read: Callable[[str], Any], text: str) -> Outcome:
    found = read(text)
    return Outcome(None, found if isinstance(found, tuple) and all(isinstance(each, str) for each in found) else ())


def answered(slip: Slip) -> Outcome:
    """What becomes of a slip; a refusal is a result."""
    try:
        return slip.answer()
    except InvalidInput as refusal:
        return Outcome(str(refusal))


def silent(slip: Slip, outcome: Outcome) -> bool:
    """Whether neither a refusal nor a notice names the place, and where a value is off by a factor, that value."""
    words = (outcome.refusal,) if outcome.refusal is not None else outcome.notices
    values = slip.typed.split() if slip.kind.startswith(("times", "over")) else []
    return not any(
        all(word in said.replace("_", "-") or word in said for word in slip.said)
        and (not values or any(_states(said, float(value)) for value in values))
        for said in words
    )


def _states(said: str, value: float) -> bool:
    numbers = re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", said)
    return any(isclose(float(number), value, rel_tol=1e-3) for number in numbers)


def chosen(count: int, seed: int) -> list[Slip]:
    """`count` slips: every place at least once if there are as many, the rest of every kind alike, at random."""
    everything = list(slips(seed))
    random.Random(seed).shuffle(everything)
    first = {slip.place: slip for slip in reversed(everything)}
    kinds: dict[str, list[Slip]] = {}
    for slip in everything:
        if first[slip.place] is not slip:
            kinds.setdefault(slip.kind, []).append(slip)
    rest = (slip for turn in zip_longest(*kinds.values()) for slip in turn if slip is not None)
    return [*first.values(), *rest][:count]


def main(count: int = 1000, seed: int = 20260101) -> int:
    """Print the outcomes. Returns 0 when nothing was accepted in silence."""
    found = [(slip, answered(slip)) for slip in chosen(count, seed)]
    noticed = [(slip, outcome) for slip, outcome in found if outcome.refusal is None and not silent(slip, outcome)]
    quiet = [(slip, outcome) for slip, outcome in found if silent(slip, outcome)]
    refused = len(found) - len(noticed) - len(quiet)
    print(f"{len(found)} slips at {len({slip.place for slip, _ in found})} places, seed {seed}")
    for kind, number in sorted(Counter(slip.kind for slip, _ in found).items()):
        print(f"  {number:5d}  {kind}")
    print(f"refused: {refused}, accepted with a notice: {len(noticed)}, in silence: {len(quiet)}")
    for heading, group in (("Accepted with a notice", noticed), ("Accepted in silence", quiet)):
        print(f"\n{heading}:")
        for slip, outcome in sorted(group, key=lambda pair: pair[0].place):
            said = outcome.refusal or "; ".join(outcome.notices)
            print(f"  {slip.place} = {slip.typed} ({slip.kind}): {said}")
    return 1 if quiet else 0


if __name__ == "__main__":
    sys.exit(main(*(int(argument) for argument in sys.argv[1:])))
