"""`rockbench file info` for people: what a data file holds, line by line."""

from typing import Any


def text_of(content: dict[str, Any]) -> str:
    """The content of `bench.record.overview`, of a campaign or a re-analysis."""
    heading = f"{content['file']}, {content['bytes'] / 1e6:.1f} MB, format {content['format_version']}"
    if "original" in content:
        return _lines({"file": heading} | _reanalysis(content))
    lines = [_lines({"file": heading} | _campaign(content))]
    lines += [
        f"channel    {each['name']}: {each['quantity']} [{each['unit']}], {each['device']}"
        for each in content["channels"]
    ]
    lines += [f"device     {name}: {said}" for name, said in content["devices"].items()]
    return "\n".join(lines)


def _lines(rows: dict[str, Any]) -> str:
    return "\n".join(f"{name:10} {value}" for name, value in rows.items() if value)


def _campaign(content: dict[str, Any]) -> dict[str, Any]:
    return {
        "campaign": content["title"],
        "protocol": content["protocol"],
        "software": " ".join(filter(None, (content["software"], content["git"]))),
        "status": ": ".join(filter(None, (content["status"], content["summary"]))),
        "time": f"{content['start_time']} to {content['end_time'] or '?'}",
        "operator": content["operator"],
        "notes": content["notes"],
        "seed": content["seed"],
        "plan": content["plan_hash"],
        "samples": f"{content['samples']} at {content['sample_rate']:g} samples/s: {content['duration']:.1f} s"
        f" in {len(content['runs'])} runs",
        "points": f"{content['points']}; {content['events']} events",
        "tables": ", ".join(f"{name} ({rows} rows)" for name, rows in content["tables"].items()),
        "checksums": _checksums(content),
        "recovered": "; ".join(content["recovered"]),
    }


def _reanalysis(content: dict[str, Any]) -> dict[str, Any]:
    of = content["original"]
    return {
        "analysis": content["title"],
        "software": content["software"],
        "date": content["date"],
        "original": f"{of['file']}, {content['original_is']}; SHA-256 {of['sha256']}",
        "settings": ", ".join(f"{name} = {value}" for name, value in content["settings"].items()),
        "points": content["points"],
        "checksums": _checksums(content),
    }


def _checksums(content: dict[str, Any]) -> str:
    if not content["checksums"]:
        return "none"
    left = content.get("unchecked", 0)
    wrong = f"{len(content['failing'])} do not hold" if content["failing"] else "those looked at hold"
    rest = f"; {left} not looked at, `rockbench file verify` does" if left else ""
    return f"{content['checksums']} datasets; {wrong}{rest}"
