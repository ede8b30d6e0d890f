"""What the sensor says to a command: lines of text up to the prompt `->`, perhaps with measured values in between."""

import re

_WORD = re.compile(rb"[\x00-\x3f][\x40-\x7f][\x80-\xff]")
_PROMPT = re.compile(rb"(?:^|(?<=[\r\n\x80-\xff]))->")
"""The prompt stands in a new line: a minus sign in the text and a value may look like one. What is left of a value
that was cut off may come before it."""
_NOT_TEXT = re.compile(rb"[^\t\r\n\x20-\x7e]")


class Reply:
    """Collects what comes after a command until the prompt is there.

    Measured values keep coming while the sensor answers. They are taken out here and lost: text that cuts one in two
    would fake another.
    """

    def __init__(self) -> None:
        self.complete = False
        self.prompt_in_value = False
        """Something like a prompt came, perhaps in the middle of a value: believed when nothing else comes."""
        self.rest = b""
        """What came after the prompt."""
        self._text = b""

    def feed(self, chunk: bytes) -> None:
        """More bytes from the line; none when the reply is complete."""
        line, self._text = self._text + chunk, b""
        self.prompt_in_value |= b"->" in line
        place = 0
        for start, end in (*(word.span() for word in _WORD.finditer(line)), (len(line), len(line))):
            self._text += line[place:start]
            place = end
            if found := _PROMPT.search(self._text):
                self.complete = True
                self.rest = line[start - (len(self._text) - found.end()) :]
                self._text = self._text[: found.start()]
                return

    @property
    def lines(self) -> list[str]:
        """The lines of text, without blanks around them and without empty ones."""
        text = _NOT_TEXT.sub(b"", _WORD.sub(b"", self._text)).decode("ascii")
        return [line for part in re.split(r"[\r\n]+", text) if (line := part.strip())]


def error_in(command: str, lines: list[str]) -> str | None:
    """The sensor's error, code and text, in the lines that answer `command`; None when it was carried out.

    A code stands at the beginning of a line or after the echo of the command. Warnings, W and a number, do not stop
    the sensor from doing what it was told (manual of the optoNCDT 1320, p. 82).
    """
    name = re.escape(command.split()[0])
    for line in lines:
        if found := re.match(rf"(?:{name}\b.*?\s)?(E\d{{2,3}}\b.*)", line, re.IGNORECASE):
            return found[1].strip()
    return None


def parameters_in(name: str, lines: list[str]) -> list[str]:
    """The parameters of the setting `name`, in capitals, from the lines that answer a question for it.

    The answer is `<name> <parameter> ...`; an echo `<name> ok` may come with it, and a list may take several lines.
    """
    words = (word.upper() for line in lines for word in line.split())
    return [word for word in words if word not in (name, "OK")]
