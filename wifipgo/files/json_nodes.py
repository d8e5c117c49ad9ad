"""Values of a JSON file that know where they stand, so that what is wrong is named by file and field."""

from dataclasses import dataclass
from typing import Any

from wifipgo.errors import GraphFileError, quoted

MOST = 1e300  # numbers beyond mean nothing, and their products are none


@dataclass(frozen=True, slots=True)
class Node:
    """A value and its place.

    Attributes:
        value: As JSON has it: table, list, text, number, truth value or nothing.
        place: File and field: ``team.jrl: measurements.a[3].stamp``.
    """

    value: Any
    place: str

    def refused(self, expected: str) -> GraphFileError:
        """What to raise where the value is not what it should be."""
        return GraphFileError(self.place, 0, expected, quoted(self.value))

    def table(self) -> dict[str, "Node"]:
        """Its fields by name."""
        if not isinstance(self.value, dict) or not all(isinstance(name, str) for name in self.value):
            raise self.refused("a table of named fields")
        joint = ". "[self.place.endswith(":")]
        return {name: Node(value, f"{self.place}{joint}{name}") for name, value in self.value.items()}

    def field(self, name: str) -> "Node":
        """One of its fields, which has to be there."""
        fields = self.table()
        if name not in fields:
            raise GraphFileError(self.place.removesuffix(":"), 0, f"a field {name!r}", "none")
        return fields[name]

    def items(self) -> list["Node"]:
        """Its items in order."""
        if not isinstance(self.value, list | tuple):
            raise self.refused("a list")
        return [Node(value, f"{self.place}[{k}]") for k, value in enumerate(self.value)]

    def text(self) -> str:
        """A text."""
        if not isinstance(self.value, str):
            raise self.refused("a text")
        return self.value

    def whole(self) -> int:
        """A whole number, not negative."""
        if not isinstance(self.value, int) or isinstance(self.value, bool) or self.value < 0:
            raise self.refused("a whole number, not negative")
        return self.value

    def number(self) -> float:
        """A finite number."""
        is_number = isinstance(self.value, int | float) and not isinstance(self.value, bool)
        if not is_number or not -MOST <= self.value <= MOST:
            raise self.refused("a finite number")
        return float(self.value)

    def numbers(self, count: int) -> list[float]:
        """So many finite numbers."""
        if not isinstance(self.value, list | tuple):
            raise self.refused("a list")
        if len(self.value) != count:
            raise GraphFileError(self.place, 0, f"{count} numbers", f"{len(self.value)}")
        if all(type(value) is float and -MOST <= value <= MOST for value in self.value):
            return list(self.value)
        return [item.number() for item in self.items()]
