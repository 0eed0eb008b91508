"""Common parts of the validation cases of choices of effects."""
