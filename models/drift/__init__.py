"""Drift of force-excited vehicle models: stochastic theory, growth of errors, and the error that a stabiliser
leaves."""
