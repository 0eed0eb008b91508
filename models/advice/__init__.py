"""Advice before a decision: which setting is the cheapest, and which effects are needed."""
