"""Tyre models: creep forces of bristles in an elliptic patch; friction by formula, from tables and from property
files."""
