"""Text that users write, read the same whatever editor saved it.

UTF-8 with or without a byte order mark; lines that end in LF, CR LF or CR; form feeds and vertical
tabs are nothing ahead of a line, which they do not indent, and blanks elsewhere, since no format that is
read here lets them stand for themselves.
"""

import json
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

from wifipgo.errors import BadInputError, TextFileError, quoted

_MARKS = {
    b"\xff\xfe\x00\x00": "UTF-32",
    b"\x00\x00\xfe\xff": "UTF-32",
    b"\xff\xfe": "UTF-16",
    b"\xfe\xff": "UTF-16",
}
_AHEAD = re.compile(r"(?m)^[\f\v]+")
_NO_TEXT = "zero bytes, as in UTF-16 or a file that is no text"
_BLANK = str.maketrans({"\f": " ", "\v": " "})
MOST_BYTES = 2**31  # text beyond this is no text that somebody wrote for us
MOST_IN_LINE = 10**6
MOST_DIGITS = 400  # more than any float or key has


def read_text(path: Path, *, most_bytes: int = MOST_BYTES) -> str:
    r"""Text of a file whose lines all end in ``\n``.

    Args:
        path: The file.
        most_bytes: How long it may be.

    Raises:
        TextFileError: It is not UTF-8, or longer; names the file and the line.
        OSError: It cannot be read.
    """
    with path.open("rb") as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise TextFileError(str(path), 0, f"text of at most {most_bytes:,} bytes", "more")
    return decoded(data, str(path))


def decoded(data: bytes, source: str) -> str:
    r"""Text of bytes, all lines ended by ``\n``; ``source`` names them in messages.

    Raises:
        TextFileError: They are not UTF-8.
    """
    coding = next((name for mark, name in _MARKS.items() if data.startswith(mark)), None)
    if coding is None and b"\0" in data:
        coding = _NO_TEXT
    if coding is not None:
        raise TextFileError(source, 0, "text in UTF-8", f"{coding}; save it as UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        line = data.count(b"\n", 0, problem.start) + 1
        got = f"byte 0x{data[problem.start]:02x}; save it as UTF-8"
        raise TextFileError(source, line, "text in UTF-8", got) from None
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return _AHEAD.sub("", text).translate(_BLANK) if "\f" in text or "\v" in text else text


def read_lines(path: Path) -> list[str]:
    """Lines of a file, without their ends; line k is the k-th that an editor shows, from 0.

    Raises:
        TextFileError: It is not UTF-8, or a line or the whole is longer than text is; names the line.
        OSError: It cannot be read.
    """
    out: list[str] = []
    left = MOST_BYTES
    with path.open(encoding="utf-8-sig", errors="surrogateescape") as file:
        while text := file.readline(MOST_IN_LINE + 1):
            left -= len(text)
            if len(text) > MOST_IN_LINE or left < 0:
                expected = f"lines of at most {MOST_IN_LINE:,} characters, {MOST_BYTES:,} in all"
                raise TextFileError(str(path), len(out) + 1, expected, "more")
            out.append(text.removesuffix("\n"))
            if not text.isascii() or "\0" in text:
                _need_text(text, str(path), len(out))
    return out


def _need_text(text: str, source: str, line: int) -> None:
    """Refuse a line with bytes that are no characters, or with none at all."""
    data = text.encode("utf-8", "surrogateescape")
    with_mark = next((name for mark, name in _MARKS.items() if line == 1 and data.startswith(mark)), None)
    bad = next((c for c in text if "\udc80" <= c <= "\udcff"), None)
    got = with_mark or (_NO_TEXT if "\0" in text else f"byte 0x{ord(bad) - 0xDC00:02x}" if bad else None)
    if got is not None:
        raise TextFileError(source, line, "text in UTF-8", f"{got}; save it as UTF-8")


def read_json(path: Path) -> Any:
    """Content of a JSON file.

    Raises:
        BadInputError: It is not JSON, is nested too deep, or see `read_text`; names the file.
        OSError: It cannot be read.
    """
    return parsed_json(read_text(path), str(path))


def parsed_json(text: str, source: str) -> Any:
    """Content of JSON text; ``source`` names it in messages.

    Raises:
        BadInputError: It is not JSON, is nested too deep, or names a key twice in one table.
    """
    try:
        return json.loads(text, object_pairs_hook=_each_once)
    except json.JSONDecodeError as problem:
        place = f"{source}:{problem.lineno}: not JSON"
        raise BadInputError(f"{place}: {problem.msg} at column {problem.colno}") from None
    except RecursionError:
        raise BadInputError(f"{source}: not JSON: nested too deep") from None
    except BadInputError as problem:
        raise BadInputError(f"{source}: {problem}") from None
    except ValueError:  # a whole number of more digits than Python turns into one
        raise BadInputError(f"{source}: not JSON: a number of too many digits") from None


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A table whose keys are all different."""
    table: dict[str, Any] = {}
    for key, value in pairs:
        if key in table:
            raise BadInputError(f"expected each key once in a table, got {quoted(key)} twice")
        table[key] = value
    return table


def number(word: str, source: str, line: int) -> float:
    """A number as files write it: with a decimal point, without underscores or a thousand digits.

    Args:
        word: What should be one.
        source: File, for the message.
        line: Line, for the message.

    Raises:
        TextFileError: It is none.
    """
    if "," in word:
        raise TextFileError(source, line, "a number with a decimal point", f"a comma in {quoted(word)}")
    if _plain(word):
        with suppress(ValueError):
            return float(word)
    raise TextFileError(source, line, "a number", quoted(word))


def whole_number(word: str, source: str, line: int) -> int:
    """A whole number in decimal digits; arguments and failures as of `number`."""
    if _plain(word):
        with suppress(ValueError):
            return int(word)
    raise TextFileError(source, line, "a whole number", quoted(word))


def _plain(word: str) -> bool:
    """Whether Python would read no more into a word than its digits say."""
    return len(word) <= MOST_DIGITS and "_" not in word and word.isascii()
