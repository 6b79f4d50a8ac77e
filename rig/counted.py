"""How many of something, in words: 1 record, 2 records. Standard library only."""


def counted(count: int, one: str, several: str = "") -> str:
    """A number with the noun behind it, which takes an s where it is not one; of several words the last takes it.
    `several` stands in its place where that is not all, as with a verb: "tick was", "ticks were"."""
    return f"{count} {one}" if count == 1 else f"{count} {several or one + 's'}"
