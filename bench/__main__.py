"""`python -m bench`: runs the command `rockbench` if its script is not on the path."""

from bench.app.cli.process import run

if __name__ == "__main__":
    run()
