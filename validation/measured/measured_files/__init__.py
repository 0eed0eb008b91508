"""Measurement files that are damaged or odd, one module per format, each file written from code with its truth."""
