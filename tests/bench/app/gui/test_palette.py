"""Contrast of every text with what is behind it, after WCAG 2.2, 1.4.3: 4.5 for text of this size, 3 for lines."""

from pathlib import Path

import pytest
from PySide6.QtCore import QSettings
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from bench.app.catalogue import all_protocols
from bench.app.display.theme import DARK, LIGHT, Theme
from bench.app.gui.controller import Controller
from bench.app.gui.palette import chosen_theme, qt_palette, style_sheet
from bench.app.gui.window import Window, follow_choice
from bench.config.model import BenchConfiguration
from tests.bench.app.gui.shared_window import undressed


def _luminance(colour: QColor) -> float:
    """Relative luminance (WCAG 2.2, definition)."""
    parts = [value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4 for value in colour.getRgbF()[:3]]
    return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2]


def _contrast(one: QColor, other: QColor) -> float:
    low, high = sorted((_luminance(one), _luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
def test_everything_can_be_read_on_its_ground(theme: Theme) -> None:
    for ground in (theme.ground, theme.raised):
        for name in ("text", "faint", "calm", "good", "wait", "alarm"):
            assert _contrast(QColor(str(getattr(theme, name))), QColor(ground)) >= 4.5, name
        for line in theme.lines:
            assert _contrast(QColor(line), QColor(ground)) >= 3.0
    palette, role = qt_palette(theme), QPalette.ColorRole
    for text, ground in (
        (role.WindowText, role.Window),
        (role.Text, role.Base),
        (role.Text, role.AlternateBase),
        (role.ButtonText, role.Button),
        (role.ToolTipText, role.ToolTipBase),
        (role.HighlightedText, role.Highlight),
        (role.PlaceholderText, role.Base),
    ):
        assert _contrast(palette.color(text), palette.color(ground)) >= 4.5, text
    assert _contrast(QColor("#b30000"), QColor("white")) >= 4.5, "STOP"


def test_the_formula_is_the_published_one() -> None:
    assert _contrast(QColor("black"), QColor("white")) == pytest.approx(21.0)
    # the lightest grey that passes on white: WebAIM's table
    assert _contrast(QColor("#767676"), QColor("white")) == pytest.approx(4.54, abs=0.01)


@pytest.mark.usefixtures("without_plots")
def test_a_theme_chosen_by_hand_is_kept(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> None:
    settings = QSettings(str(tmp_path / "kept.ini"), QSettings.Format.IniFormat)
    controller = Controller()

    def opened() -> Window:
        window = Window(controller, BenchConfiguration(), all_protocols()[0], LIGHT)
        qtbot.addWidget(window)
        follow_choice(window, qapp, settings)
        return window

    with undressed():
        for chosen in ("dark", "light"):
            window = opened()
            window.setup.theme.setCurrentIndex(window.setup.theme.findData(chosen))
            assert qapp.styleSheet() == style_sheet(chosen_theme(chosen))
            assert settings.value("theme") == chosen
            qapp.setStyleSheet("")
        assert chosen_theme("dark") is DARK
        assert opened().setup.theme.currentData() == "light"
    controller.close()
