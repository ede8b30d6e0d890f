"""The style of the widgets, for a light and a dark desktop."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QGuiApplication, QPalette
from PySide6.QtWidgets import QApplication

from bench.app.display.theme import DARK, LIGHT, Theme

BASE, SMALL, VALUE, BANNER = 11, 14, 20, 26
"""Font sizes [pt] of text, of a verdict and of STOP in a small window, of live values, and of the bench's state, which
is readable at two metres.
"""


def desktop_theme() -> Theme:
    """The theme of the desktop; light if it has none."""
    return DARK if QGuiApplication.styleHints().colorScheme() == Qt.ColorScheme.Dark else LIGHT


def chosen_theme(name: str) -> Theme:
    """The theme `light` or `dark`; for any other name, that of the desktop."""
    return {"light": LIGHT, "dark": DARK}.get(name) or desktop_theme()


def qt_palette(theme: Theme) -> QPalette:
    """The Qt palette of a theme."""
    palette = QPalette()
    role = QPalette.ColorRole
    for roles, colour in (
        ((role.Window, role.AlternateBase), theme.ground),
        ((role.Base, role.Button, role.ToolTipBase), theme.raised),
        ((role.WindowText, role.Text, role.ButtonText, role.ToolTipText), theme.text),
        ((role.PlaceholderText,), theme.faint),
        ((role.Highlight,), theme.wait),
        ((role.HighlightedText,), theme.raised),
    ):
        for each in roles:
            palette.setColor(each, QColor(colour))
    for each in (role.WindowText, role.Text, role.ButtonText):
        palette.setColor(QPalette.ColorGroup.Disabled, each, QColor(theme.faint))
    return palette


def style_sheet(theme: Theme) -> str:
    """Style sheet that supplements the palette; the dynamic property `level` selects the colours of states."""
    return f"""
    * {{ font-size: {BASE}pt; }}
    QPushButton {{ min-height: 32px; padding: 2px 14px; }}
    QPushButton[tight="yes"] {{ padding: 2px 6px; }}
    QLineEdit, QComboBox {{ min-height: 26px; }}
    QTabBar::tab {{ min-height: 32px; min-width: 76px; }}
    QTabWidget#motion QTabBar::tab {{ min-height: 24px; min-width: 40px; padding: 0px 6px; }}
    QLabel[role="word"] {{ font-size: {BANNER}pt; font-weight: bold; }}
    QLabel[role="value"] {{ font-size: {VALUE}pt; font-weight: bold; }}
    QLabel[role="verdict"] {{ font-size: {SMALL}pt; font-weight: bold; }}
    QLabel[role="faint"] {{ color: {theme.faint}; }}
    QLabel[level="calm"] {{ color: {theme.calm}; }}
    QLabel[level="good"] {{ color: {theme.good}; }}
    QLabel[level="wait"] {{ color: {theme.wait}; }}
    QLabel[level="alarm"] {{ color: {theme.alarm}; font-weight: bold; }}
    QFrame#prompt {{ border: 3px solid {theme.wait}; background: {theme.raised}; }}
    QFrame#trouble, QFrame#leave {{ border: 3px solid {theme.alarm}; background: {theme.raised}; }}
    QFrame#welcome {{ border: 1px solid {theme.faint}; background: {theme.raised}; }}
    QFrame#welcome QLabel[guided="yes"] {{ font-weight: bold; }}
    QPushButton[guided="yes"], QTabWidget[guided="yes"]::pane {{ border: 3px solid {theme.wait}; border-radius: 4px; }}
    QPushButton#stop {{ background: #b30000; color: white; font-size: {BANNER}pt; font-weight: bold;
        min-width: 250px; min-height: 72px; padding: 2px; border: 3px solid {theme.text}; border-radius: 8px; }}
    QPushButton#stop[low="yes"] {{ font-size: {SMALL}pt; min-width: 130px; min-height: 50px; }}
    QPushButton#stop:pressed {{ background: #700000; }}
    QLabel[role="word"][low="yes"] {{ font-size: {VALUE}pt; }}
    QWidget#header[latched="yes"] {{ background: #b30000; }}
    QWidget#header[latched="yes"] QPushButton#stop {{ background: #4d0000; border-color: white; }}
    QWidget#header[latched="yes"] QLabel {{ color: white; }}
    """


def dress(application: QApplication, theme: Theme) -> None:
    """Apply a theme to every widget."""
    # styling every widget takes a long time, so a theme that is already in use is kept
    if application.styleSheet() == style_sheet(theme):
        return
    application.setStyle("Fusion")
    application.setPalette(qt_palette(theme))
    application.setStyleSheet(style_sheet(theme))
