"""The report: one self-contained page, from saved results alone; it never simulates."""
