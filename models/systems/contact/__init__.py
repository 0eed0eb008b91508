"""One rolling contact, or a table of them."""

ENGINES: tuple[str, ...] = ()
