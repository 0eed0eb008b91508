"""What validation cases of choices of effects share."""
