"""Samples of stated and true errors from random scenes, with a module for each system."""
