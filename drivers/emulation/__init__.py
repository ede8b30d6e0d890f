"""Stand-ins for the instruments: they speak the real protocols, and behind them moves the virtual bench."""
