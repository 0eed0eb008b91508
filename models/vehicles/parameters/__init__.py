"""Parameter sets: one file each, named after its source, holding ``SOURCE`` and ``PARAMETERS``."""
