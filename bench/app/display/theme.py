"""Display colours for a light and a dark background, based on the palette of Okabe and Ito."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Theme:
    """Colours as #rrggbb. `ground` is the background, `calm` to `alarm` are those of the levels, and `lines` those of
    curves, with enough contrast on the background.
    """

    ground: str
    raised: str
    text: str
    faint: str
    calm: str
    good: str
    wait: str
    alarm: str
    lines: tuple[str, ...]


LIGHT = Theme(
    *("#efefef", "#ffffff", "#000000", "#5a5a5a", "#5a5a5a", "#00694d", "#0072B2", "#b34700"),
    lines=("#000000", "#0072B2", "#b34700", "#00694d", "#8a4a70"),
)
DARK = Theme(
    *("#1e1e1e", "#2a2a2a", "#f0f0f0", "#a8a8a8", "#a8a8a8", "#00AB7D", "#56B4E9", "#E69F00"),
    lines=("#f0f0f0", "#56B4E9", "#E69F00", "#F0E442", "#CC79A7"),
)
