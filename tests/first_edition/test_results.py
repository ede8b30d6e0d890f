"""Short runs with fixed seeds: the same digits, samples and kinds of files as the first edition gave."""

import json
import shlex
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import h5py
import pytest

from tests.first_edition import inventory
from tests.first_edition.command import DATA, EXCEPTED, Rockbench, differences, rounded, rounded_elsewhere

pytestmark = pytest.mark.usefixtures("shared_results")

COMMANDS = {words[-1]: words[1:] for words in map(shlex.split, (DATA / "commands.txt").read_text("utf-8").splitlines())}
QUICK = {
    "coupling_stiffness",
    "earthquake",
    "free_rocking",
    "harmonic_springs",
}
"""One run of each protocol that is not long; that of the springs has decays of the bare frame as well. The other run of
the harmonic protocol is replayed from its file, with the twin, by `test_files`."""

RENAMED = {"predicted for the asked motion": "predicted for the requested motion"}
"""What keys and texts of the first edition are called today, by each part of them that was renamed: standard terms."""

SETTLING = {"harmonic_point", "harmonic_springs"}
"""Runs that wait until the motion is steady: another rounding may end the wait a window later."""

WITH_PASSES = {"earthquake"}
"""Runs whose protocol declares the table of the passes of a replication, which every file had."""

ADDED = {
    "check": ("--delay-tolerance", "0.0005"),
    "earthquake": ("--laser-block", "0"),
    "harmonic_springs": ("--laser-block", "0"),
    "harmonic_point": ("--laser-block", "0"),
}
"""What a command needs today.

The first edition did not compare the delays of the table's two sensors. With so few samples and an amplifier of 20 Hz,
the steps of the drive shift the acceleration by 0.35 ms more than half a sample, which the default tolerance does not
allow. It did not find the errors of the lasers from the motion.
"""


@dataclass(frozen=True)
class Run:
    """A run of today, and its folder."""

    name: str
    printed: dict[str, object]
    folder: Path

    @property
    def recorded(self) -> dict[str, object]:
        """What the first edition printed, in today's words."""
        text = (DATA / f"{self.name}.json").read_text(encoding="utf-8")
        for old, new in RENAMED.items():
            text = text.replace(old, new)
        return json.loads(text)


def _table_of_today(folder: Path) -> None:
    """The identified table, as old as a run accepts it."""
    model = json.loads((DATA / "table_model.json").read_text(encoding="utf-8"))
    model["date"] = datetime.now(UTC).replace(microsecond=0).isoformat()
    (folder / "table_model.json").write_text(json.dumps(model), encoding="utf-8")


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=() if name in QUICK else pytest.mark.soak) for name in COMMANDS],
)
def run(
    request: pytest.FixtureRequest, rockbench: Rockbench, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Run]:
    """The same command again, in a folder of its own."""
    name, folder = request.param, tmp_path_factory.mktemp("run")
    for path in DATA.glob("*.toml"):
        shutil.copy(path, folder)
    _table_of_today(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        done = rockbench(*COMMANDS[name], *ADDED.get(name, ()))
    assert done.code == 0, done.err
    yield Run(name, json.loads(done.out), folder / name)
    shutil.rmtree(folder)


def only_here(same_arithmetic: bool) -> None:
    if not same_arithmetic:
        pytest.skip("this processor rounds otherwise than the one that computed the first edition's digits")


def test_every_digit_of_its_results_is_the_same(run: Run, same_arithmetic: bool) -> None:
    if run.name in SETTLING:
        only_here(same_arithmetic)
    share = rounded if same_arithmetic else rounded_elsewhere
    assert not sorted(differences(run.recorded, run.printed, share=share))


def test_every_sample_and_the_drive_are_the_same(
    run: Run, unpacked: Callable[[str], Path], same_arithmetic: bool
) -> None:
    only_here(same_arithmetic)
    with h5py.File(unpacked(run.name)) as old, h5py.File(run.folder / "campaign.h5") as new:
        before, after = old["entry/instrument"], new["entry/instrument"]
        channels = [name for name, group in before.items() if isinstance(group, h5py.Group) and "counts" in group]
        assert len(channels) == 4
        for name in (*(f"{channel}/counts" for channel in channels), "drive/voltage"):
            assert (before[name][:] == after[name][:]).all(), name


def test_its_summary_and_its_output_agree(run: Run) -> None:
    summary = json.loads((run.folder / "summary.json").read_text(encoding="utf-8"))
    assert summary.keys() >= run.recorded.keys() - EXCEPTED
    assert all(summary[key] == value for key, value in run.printed.items())


def test_it_leaves_every_file(run: Run) -> None:
    before = json.loads((DATA / "inventory.json").read_text(encoding="utf-8"))["files"][run.name]
    assert {RENAMED.get(name, name) for name in before} <= {path.name for path in run.folder.iterdir()}


def test_its_file_has_every_table_and_column(run: Run) -> None:
    content = json.loads((DATA / "inventory.json").read_text(encoding="utf-8"))["tables"]
    before, after = content["every file"] | content[run.name], inventory.tables(run.folder / "campaign.h5")
    if run.name not in WITH_PASSES:
        before = {name: said for name, said in before.items() if not name.startswith("entry/passes/")}
    assert not {name: said for name, said in before.items() if after.get(RENAMED.get(name, name)) != said}


def _journal(file: h5py.File) -> list[tuple[str, str]]:
    """Kind and text of every event."""
    kinds, texts = (file[f"entry/events/{name}"][:] for name in ("kind", "text"))
    return [(kind.decode(), text.decode()) for kind, text in zip(kinds, texts, strict=True)]


def test_its_journal_has_the_same_events_in_the_same_order(run: Run, unpacked: Callable[[str], Path]) -> None:
    with h5py.File(unpacked(run.name)) as old, h5py.File(run.folder / "campaign.h5") as new:
        before, after = _journal(old), _journal(new)
    # the first edition did not warn, before anything else, of values outside their usual range
    while after[0][0] == "Warned" and " the usual " in after[0][1]:
        del after[0]
    kinds = [RENAMED.get(kind, kind) for kind, _ in before]
    if run.name == "check":
        # some of its lines were added after the first edition, all of them after the sines
        summary = json.loads((run.folder / "summary.json").read_text(encoding="utf-8"))
        more = len(summary["points"]) - kinds.count("PointFinished")
        last = len(kinds) - kinds[::-1].index("PointFinished")
        kinds[last:last] = more * ["PointFinished"]
    assert kinds == [kind for kind, _ in after]
