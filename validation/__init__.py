"""Validation of twinrig's claims: cases, their rows, and the report that reads them."""
