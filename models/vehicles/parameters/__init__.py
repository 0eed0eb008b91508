"""Parameter sets of the pitch-plane vehicle: one file each, named after its source, with ``SOURCE`` and
``PARAMETERS``."""
