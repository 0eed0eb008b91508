"""One rolling contact, or a table of them."""

ENGINES: tuple[str, ...] = ()
NO_PRICE = "has cells in place of steps, which the study contact_price prices"
"""Why `twinrig price` has nothing to choose, and what there is instead."""
