"""What the command line does beside studies: find what was asked for, sweep a key, compare results."""
