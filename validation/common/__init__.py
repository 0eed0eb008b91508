"""Common parts of all validation cases: report rows and their verdicts, confidence bands, scenes, saved results."""
