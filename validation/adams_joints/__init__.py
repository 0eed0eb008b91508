"""Comparison with Adams/Solver: its model files of single bodies on joints are read, built for the engines and run."""
