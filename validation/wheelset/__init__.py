"""The wheelset once more in plain code."""
