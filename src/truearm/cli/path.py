"""``truearm path``."""


def path() -> None:
    """Follow a path."""
