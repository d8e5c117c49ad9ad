"""Files of JSON, and of CBOR, its short form, which the extra ``cbor`` reads."""

from pathlib import Path
from typing import Any

from wifipgo.command.extras import load_extra
from wifipgo.errors import BadInputError
from wifipgo.files.atomic_files import write_bytes, write_json
from wifipgo.files.text_files import read_json

CBOR = ".cbor"


def content(path: Path) -> Any:
    """What a file holds, by its name's end.

    Raises:
        BadInputError: It is not what its name says, or no reader of CBOR is installed.
        OSError: It cannot be read.
    """
    if path.suffix.lower() != CBOR:
        return read_json(path)
    load_extra(f"reading {path.name}", "cbor", "cbor2")
    import cbor2  # noqa: PLC0415 (an extra)

    try:
        return cbor2.loads(path.read_bytes())
    except (cbor2.CBORError, ValueError, RecursionError, MemoryError, OverflowError) as problem:
        raise BadInputError(f"{path}: not CBOR: {problem or type(problem).__name__}") from None


def write_content(path: Path, table: Any) -> None:
    """Write a file, whole or not at all; CBOR if its name ends so, else JSON."""
    if path.suffix.lower() != CBOR:
        write_json(path, table)
        return
    load_extra(f"writing {path.name}", "cbor", "cbor2")
    import cbor2  # noqa: PLC0415 (an extra)

    write_bytes(path, cbor2.dumps(table))
