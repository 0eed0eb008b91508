"""A wheelset held on its rails at lateral displacements."""

ENGINES: tuple[str, ...] = ()
