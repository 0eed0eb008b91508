"""The wheelset's equations of motion written a second time in plain code, for comparison."""
