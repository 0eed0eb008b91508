"""The validation report: one self-contained HTML page, written from saved results without any simulation."""
