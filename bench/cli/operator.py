"""Asks the operator at the terminal."""

import sys
from typing import TextIO

from bench.engine.operator import Operator, Unattended
from sim.errors import RockbenchError

_YES = frozenset({"", "y", "yes", "done", "ok"})
_NO = frozenset({"n", "no"})
_HOW = "Press Enter when it is done, or n and Enter to end the run: "


class AtTheConsole:
    """A person at the keyboard. Questions go to standard error: standard output belongs to the result."""

    name = "operator at the console"

    def __init__(self, answers: TextIO | None = None, questions: TextIO | None = None) -> None:
        self._answers, self._questions = answers or sys.stdin, questions or sys.stderr
        self._asking = False

    @property
    def asking(self) -> bool:
        """Whether a question stands unanswered: a signal handler must then break the wait by raising."""
        return self._asking

    def confirm(self, request: str) -> bool:
        """Ask until the answer is yes or no; the end of the input and Ctrl-C are a no."""
        self._asking = True
        try:
            return self._answer(request)
        except KeyboardInterrupt:
            print(file=self._questions)
            return False
        finally:
            self._asking = False

    def _answer(self, request: str) -> bool:
        while True:
            print(f"{request}\n{_HOW}", end="", file=self._questions, flush=True)
            line = self._answers.readline()
            if line == "" or line.strip().lower() in _NO:
                return False
            if line.strip().lower() in _YES:
                return True


def choose(*, serves_itself: bool, yes: bool, ask: bool, terminal: bool) -> Operator:
    """Who answers the questions of a run.

    A bench that `serves_itself` does the hand work unless `ask`; on a real one a person at a `terminal` is asked
    unless `yes`. Raises RockbenchError when nobody could answer.
    """
    if yes and ask:
        raise RockbenchError("--yes and --ask contradict each other: give one of the two")
    if yes:
        return Unattended("unattended run (--yes)")
    if ask:
        return AtTheConsole()
    if serves_itself:
        return Unattended("the bench itself")
    if terminal:
        return AtTheConsole()
    raise RockbenchError("nobody can answer the operator's questions: run in a terminal, or give --yes")
