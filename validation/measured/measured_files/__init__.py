"""Damaged or unusual measurement files, one module per format. Code writes each file and knows the correct values."""
