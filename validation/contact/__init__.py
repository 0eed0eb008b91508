"""Sets of contacts, exact answers and bounds that cases and tests of rolling contact share."""
