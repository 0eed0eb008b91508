"""Stated errors of random scenes against truths a hundred times finer."""
