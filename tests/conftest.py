"""What every test shares."""

import os

# a test needs no screen; a person who wants to see the windows sets the variable himself
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
