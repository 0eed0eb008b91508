"""Sets of contacts, exact solutions and bounds that the validation cases and tests of rolling contact share."""
