"""Small writers of every format, made from the formats' descriptions and not from the readers."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, log10

import numpy as np


def fortran(value: float, width: int, digits: int) -> str:
    """As `E{width}.{digits}` of Fortran writes it: no digit before the point, and no zero either."""
    exponent = 0 if value == 0.0 else floor(log10(abs(value))) + 1
    mantissa = f"{abs(value) / 10.0**exponent:.{digits}f}"
    if mantissa.startswith("1"):
        exponent, mantissa = exponent + 1, f"{abs(value) / 10.0 ** (exponent + 1):.{digits}f}"
    return f"{'-' if value < 0 else ''}{mantissa.removeprefix('0')}E{exponent:+03d}".rjust(width)


def scientific(value: float, width: int, digits: int) -> str:
    return f"{value:{width}.{digits}E}"


def fixed(value: float, width: int, digits: int) -> str:
    return f"{value:{width}.{digits}f}"


@dataclass(frozen=True)
class Block:
    """The samples as they are written, `columns` to a row."""

    fields: Sequence[str]
    columns: int

    @property
    def values(self) -> np.ndarray:
        """What the digits say."""
        return np.array([float(field) for field in self.fields])

    @property
    def rows(self) -> list[str]:
        return ["".join(self.fields[k : k + self.columns]) for k in range(0, len(self.fields), self.columns)]

    @property
    def peak(self) -> str:
        return self.fields[int(np.abs(self.values).argmax())].strip()


PEER_SIZES = {
    "1999": "NPTS=  {count}, DT= {dt} SEC",
    "2005": "NPTS=   {count}, DT=   {dt} SEC,                                             ",
    "west2": "NPTS=   {count}, DT=   {dt} SEC                                              ",
    "pacific": "    {count}    {dt}    NPTS, DT",
    "bare": "NPTS={count},DT={dt}",
}


def peer(block: Block, dt: str, size: str = "1999", quantity: str = "ACCELERATION", unit: str = "G") -> list[str]:
    return [
        "PEER STRONG MOTION DATABASE RECORD. PROCESSING BY NOBODY.",
        "NOWHERE 1/2/34 0506, SOMEWHERE, 180 (STATION 7)",
        f"{quantity} TIME HISTORY IN UNITS OF {unit}. FILTER POINTS: HP=0.2 Hz LP=15.0 Hz",
        PEER_SIZES[size].format(count=len(block.fields), dt=dt),
        *block.rows,
    ]


def peer_matched(block: Block, dt: str) -> list[str]:
    """With the headers of an earlier stage above its own, as spectrum-compatible files have them."""
    return [
        "TIME-DOMAIN CORRECTION",
        "********OLD HEADERS FOLLOW:*********************",
        "PEER NGA STRONG MOTION DATABASE RECORD",
        "OUTPUT ACCELERATION TIME HISTORY (G'S): NIT = 2",
        "NPTS= 16384, DT = .0100 SEC, AMAX = .9094E-01 G",
        "********END OF OLD HEADERS**********************",
        f"NPTS= {len(block.fields)}, DT= {dt} SEC",
        *block.rows,
    ]


def esm(block: Block, dt: str, quantity: str = "ACCELERATION", unit: str = "cm/s^2") -> list[str]:
    return [
        "EVENT_NAME: NOWHERE",
        "EVENT_TIME_HHMMSS: 160908",
        "MAGNITUDE_W: ",
        "STREAM: HNE",
        f"SAMPLING_INTERVAL_S: {dt}",
        f"NDATA: {len(block.fields)}",
        f"UNITS: {unit}",
        f"PGA_{unit.upper()}: {block.peak}",
        f"DATA_TYPE: {quantity}",
        "ORIGINAL_DATA_MEDIATOR: http://example.org/",
        "USER5: ",
        *block.rows,
    ]


def itaca(block: Block, dt: str, quantity: str = "Accelaration", unit: str = "m/s/s") -> list[str]:
    return [
        "Event Date & Time             : 2009-04-06 01:32:39",
        "Station Code / Name           : 1 / Nowhere: the centre",
        "Network                       : none",
        "Orientation                   : WE",
        "Processing Info               : none",
        "Filter Cut-off Frequency (Hz) : 0.100 - 50.000",
        f"Time Increment (s)            : {dt}",
        f"Number of Data                : {len(block.fields)}",
        f"PGA (m/s/s)                   : {block.peak}",
        f"{quantity} time series in {unit}",
        *block.rows,
    ]


def csmip(blocks: dict[str, Block], dt: str, stated: str = "", upper: bool = True) -> list[str]:
    """Channels by their names, numbered from 1; velocity and displacement are rows of zeros."""
    lines: list[str] = []
    for number, (name, block) in enumerate(blocks.items(), 1):
        header = [
            f"Corrected accelerogram   12345-S1234-83123.01       Chan  {number}: {name}       from",
            "Uncorrected accelerogram data              Processed:  6/06/83",
            f"Peak acceleration =  {block.peak}    cm/sec/sec  at   10.940   sec.",
            *["Nowhere earthquake"] * 22,
            *["    1    1    1    3    3    0    1    1    0    0    0    0    0    0    0    0"] * 7,
            *["      .041      .630    65.000      .030      .100     1.870     -.275    10.947"] * 13,
        ]
        count = len(block.fields)
        for what, unit, rows in (
            ("accel", "cm/sec/sec", block.rows),
            ("veloc", "cm/sec", ["      .000" * 8]),
            ("displ", "cm", ["      .000" * 8]),
        ):
            if stated:
                header.append(f" {count} points of {what} data equally spaced at {dt} sec, in {unit}. {stated}")
            else:
                header.append(f" {count} points of {what} data equally spaced at  {dt} sec.  (units: {unit})")
            header += rows
        lines += [*header, f"/&  ----------  End of data for channel  {number}  ----------"]
    return [line.upper() for line in lines] if upper else lines


def cosmos(
    blocks: dict[str, Block], dt: str, stated: str, unit: str = "cm/sec2(04)", recorder: str | None = None
) -> list[str]:
    """Channels by their names, numbered from 1, each followed by a velocity; the recorder's step is `dt` by default."""
    lines: list[str] = []
    for number, (name, block) in enumerate(blocks.items(), 1):
        lasts = round(len(block.fields) * float(dt))
        reals = ["-999.000000"] * 100
        # that of the recorder, and that of the samples [ms]
        reals[33] = dt if recorder is None else recorder
        reals[61] = "-999.000000" if recorder is None else f"{1e3 * float(dt):.6f}"
        for what, its_unit, part in (
            ("acceleration", unit, block),
            ("velocity", "cm/sec(05)", Block(["   0.00000"] * 9, 8)),
        ):
            form = stated if what == "acceleration" else "(8F10.5)"
            lines += [
                f"Corrected {what}   (Format v01.20 with 13 text lines)  Src: 052SSN08",
                "Earthquake of nowhere",
                f"Sta Chan   {number}: {name} (Rcrdr Chan  {number}) Location:Ground",
                f"Processed: 01/02/03 by nobody            Max =  {part.peak} cm/sec^2   at  10.045 sec",
                " 100 Integer-header values follow on  10 lines, Format= (10I8)",
                *["    -999" * 10] * 10,
                " 100 Real-header values follow on  20 lines, Format= (5F15.6)",
                *("".join(real.rjust(15) for real in reals[k : k + 5]) for k in range(0, 100, 5)),
                '   1 Comment line(s) follow, each starting with a "|":',
                "| 12 acceleration pts, of a comment",
                f"   {len(part.fields)} {what} pts, approx {lasts:3d} secs, units={its_unit},Format={form}",
                *part.rows,
                f"End-of-data for Chan  {number} {what}",
            ]
    return lines


def knet(counts: Sequence[int], rate: int, peak: str, direction: str = "N-S", dot: str = ".") -> list[str]:
    return [
        "Origin Time       2018/01/24 19:51:00",
        *["Lat.              41.0"] * 9,
        f"Sampling Freq(Hz) {rate}Hz",
        f"Duration Time(s)  {len(counts) // rate}",
        f"Dir.              {direction}",
        "Scale Factor      3920(gal)/6182761",
        f"Max{dot} Acc. (gal)   {peak}",
        "Last Correction   2018/01/24 19:51:43",
        "Memo.             ",
        *("".join(f"{count:8d} " for count in counts[k : k + 8]) for k in range(0, len(counts), 8)),
    ]


def smc(block: Block, rate: str, kind: str = "2 CORRECTED ACCELEROGRAM", comments: int = 2) -> list[str]:
    integers = ["-32768"] * 48
    integers[15], integers[16] = str(comments), str(len(block.fields))
    largest, smallest = max(block.values), min(block.values)
    reals = ["0.1700000E+39"] * 50
    reals[1] = rate
    reals[29], reals[31] = fortran(largest, 13, 7).strip(), fortran(smallest, 13, 7).strip()
    return [
        kind.ljust(80),
        "*",
        "SAF0A",
        "     1989  10  18    0004 Nowhere",
        "Moment Mag=      7.1 Ms=      7.1 Ml=      7.0",
        "station = Nowhere component=    360",
        "epicentral dist =     89.0       pk     =    104.4",
        "inst type=SMA-1      data source = USGS",
        *["*"] * 3,
        *("".join(word.rjust(10) for word in integers[k : k + 8]) for k in range(0, 48, 8)),
        *("".join(word.rjust(15) for word in reals[k : k + 5]) for k in range(0, 50, 5)),
        *["|a comment 1 2 3"] * comments,
        *block.rows,
    ]
