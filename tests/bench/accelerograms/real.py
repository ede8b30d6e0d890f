"""Where recorded ground motions are: they belong to their owners and are not part of the project."""

import os
from pathlib import Path

import pytest

_BESIDE = Path(__file__).resolve().parents[4] / "shared" / "records" / "campaign"
CAMPAIGN = Path(os.environ.get("ROCKBENCH_RECORDS", _BESIDE))
FORMATS = CAMPAIGN.parent / "formats"


def needed(path: Path) -> Path:
    """The file, or a test that is skipped."""
    if not path.is_file():
        pytest.skip(f"{path.name} is not there: set ROCKBENCH_RECORDS to a folder of records")
    return path
