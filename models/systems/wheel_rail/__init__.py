"""Static contact of a wheelset on its rails, at prescribed lateral displacements."""

ENGINES: tuple[str, ...] = ()
