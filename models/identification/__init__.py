"""Parameters of a model from a measurement: what the data determine, how well, and how far a prediction may be off."""
