"""Errors that results state, compared with true errors by runs about a hundred times more accurate, on random
scenes."""
