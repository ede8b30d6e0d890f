"""Runs the command `rockbench` as `python -m bench`, for use where its script is not on the path."""

from bench.app.cli.process import run

if __name__ == "__main__":
    run()
