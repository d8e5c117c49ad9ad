"""Pages of the documentation of which a part between two marks is written by a command."""

from wifipgo.errors import require


def filled(page: str, begin: str, end: str, text: str, *, where: str) -> str:
    """The page with a text between its marks.

    Args:
        page: What is there.
        begin: The mark before it, which stays.
        end: The mark behind it, which stays.
        text: What is to stand between them.
        where: Name of the page, for messages.

    Raises:
        BadInputError: It has no such marks.
    """
    before, _, rest = page.partition(begin)
    _, found, after = rest.partition(end)
    require(bool(found), where, f"with {begin} and {end}", "a page without")
    return f"{before}{begin}\n\n{text}\n\n{end}{after}"
