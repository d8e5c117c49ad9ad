"""Tables and lines on a terminal whose text steers nothing, and in which no name is cut."""

from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from wifipgo.command.command_line import printable


class Terminal(Console):
    """Console of rich in which control characters come from rich alone, never from what is printed."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Segments of anything that can be printed, their text `printable`; long words go on below."""
        if isinstance(renderable, Table):
            for column in renderable.columns:
                column.overflow = "fold"
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else printable(text), style, control)

    def on_broken_pipe(self) -> None:
        """Let `wifipgo.command.command_line.exit_code` end the command; rich would exit with 1."""
        raise  # noqa: PLE0704 (rich calls this where it caught the failure)


def say(console: Console, text: str) -> None:
    """Print as it is: no markup, no colours for numbers, no breaks within a line."""
    console.print(Text(text), soft_wrap=True, highlight=False)
