"""Errors that a worker process hands to the one that asked."""

import pickle

import pytest

from bench.plugins import PluginFailed
from drivers.errors import RigError
from sim.errors import InvalidInput, RockbenchError
from sim.extras import MissingExtra


@pytest.mark.parametrize(
    "error",
    [
        InvalidInput("beta", -1.0, "above 0"),
        MissingExtra("the window", "gui", "PySide6"),
        RigError("no answer", 4),
        PluginFailed("my protocol", "no module"),
        RockbenchError("something else"),
    ],
)
def test_an_error_is_the_same_in_another_process(error: RockbenchError) -> None:
    found = pickle.loads(pickle.dumps(error))
    assert type(found) is type(error)
    assert (str(found), found.cause) == (str(error), error.cause)
    assert vars(found) == vars(error)
    with pytest.raises(type(error)):
        raise found
