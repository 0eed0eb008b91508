"""What twinrig claims, measured: cases, their rows, and the report that reads them."""
