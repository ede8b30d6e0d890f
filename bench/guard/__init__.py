"""The guard, the only path to the shaker."""
