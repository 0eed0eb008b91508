"""Rolling contact of two elastic bodies: creep forces of a single contact, or of a table of contacts."""

ENGINES: tuple[str, ...] = ()
