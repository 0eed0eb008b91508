"""Appearance of every figure: sizes, colours, axes."""
