"""Common parts of the validation cases on the automatic choice of effects."""
