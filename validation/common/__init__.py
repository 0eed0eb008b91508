"""Common parts of all cases: rows and their verdicts, bands, timing, scenes, kept results."""
