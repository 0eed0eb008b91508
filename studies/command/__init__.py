"""Commands beside studies: find what was asked for, sweep a key, compare results."""
