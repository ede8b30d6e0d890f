"""Help on a parameter of a protocol: its description, and a button that opens the reference page."""

from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QUrl, Signal
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from bench.app.display import texts
from bench.app.display.typography import typeset
from bench.app.gui.form import default_text
from bench.app.gui.widgets import set_level
from bench.config.declared import Declared
from bench.document.typography import label, unit_text
from bench.protocol import Protocol

PAGE = Path("reference", "protocols.md")
"""Reference page of the parameters, relative to the documentation folder."""


def reference_page(protocol: str, root: Path | None = None) -> tuple[str, QUrl | None]:
    """Path of the reference page, with the section on a protocol's parameters, and the URL of this section in the built
    site or in the source tree at `root`. The URL is None for an installation without pages.
    """
    root = Path(__file__).parents[3] if root is None else root
    section = f"parameters-of-{protocol}"
    site, page = root / "site" / PAGE.with_suffix("") / "index.html", root / "docs" / PAGE
    found = next((each for each in (site, page) if each.is_file()), None)
    if found is None:
        return f"{Path('docs', PAGE).as_posix()}#{section}", None
    address = QUrl.fromLocalFile(str(found))
    address.setFragment(section)
    return f"{found}#{section}", address


def reference_text(entry: Declared) -> list[str]:
    """Paragraphs on a parameter: meaning, valid values, default, usual values, and its option and key."""
    unit = "" if entry.unit in ("", "1") else f" {unit_text(entry.unit)}"
    lines = [
        f"{typeset(entry.description[:1].upper() + entry.description[1:])}.",
        texts.MUST_BE.format(allowed=typeset(entry.allowed_in_unit)),
    ]
    if default := default_text(entry):
        lines.append(texts.HELP_DEFAULT.format(default=f"{default}{unit}"))
    if entry.usual is not None:
        low, high = entry.usual
        lines.append(texts.HELP_USUAL.format(low=f"{low:g}", high=f"{high:g}", unit=unit))
    option = entry.name.replace("_", "-")
    return [*lines, texts.HELP_TYPED.format(option=option, key=entry.name)]


class HelpPanel(QWidget):
    """Panel with the help on one parameter, which needs no network."""

    closed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.title, self.text, self.page = QLabel(), QLabel(wordWrap=True), QLabel(wordWrap=True)
        self.title.setProperty("role", "value")
        set_level(self.page, "calm")
        for part in (self.text, self.page):
            part.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.open_page, self.close_help = QPushButton(texts.HELP_OPEN), QPushButton(texts.HELP_CLOSE)
        self.open_page.setToolTip(texts.HELP_OPEN_TIP)
        self.close_help.setToolTip(texts.HELP_CLOSE_TIP)
        self.address: QUrl | None = None
        self.open_page.clicked.connect(self._open)
        self.close_help.clicked.connect(self.closed)
        row = QHBoxLayout()
        row.addStretch(1)
        row.addWidget(self.open_page)
        row.addWidget(self.close_help)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        for part in (self.title, self.text, self.page):
            column.addWidget(part)
        column.addStretch(1)
        column.addLayout(row)

    def explain(self, protocol: Protocol[Any], entry: Declared) -> None:
        """Show the reference of a parameter."""
        self.title.setText(f"{protocol.name}: {label(entry.name)}")
        self.text.setText("\n\n".join(reference_text(entry)))
        page, self.address = reference_page(protocol.name)
        self.page.setText(texts.HELP_PAGE.format(page=page))
        self.open_page.setVisible(self.address is not None)

    def _open(self) -> None:
        if self.address is not None:
            QDesktopServices.openUrl(self.address)
