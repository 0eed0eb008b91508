"""What all cases share: rows and their verdicts, bands, timing, scenes, kept results."""
