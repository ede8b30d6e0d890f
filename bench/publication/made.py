"""When a report was made and with what."""

from datetime import datetime

from bench.provenance import software


def made_line() -> str:
    """One sentence for under the title."""
    now = datetime.now().astimezone().isoformat(timespec="seconds")
    version = software()["rocking-bench"]
    units = "α₂ is the peak drift of the coupled frame over that of the bare one, α₁ the same of u₁ (Eq. 10)."
    return f"Report made on {now} by rocking-bench {version}. {units}"
