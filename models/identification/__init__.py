"""Identification of model parameters from a measurement: estimates, their uncertainty, and the error of predictions."""
