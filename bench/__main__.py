"""`python -m bench`: the command `rockbench` where its script is not on the path."""

from bench.cli.process import run

if __name__ == "__main__":
    run()
