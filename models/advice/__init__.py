"""What users ask before they decide: which setting is the cheapest, and which effects are needed."""
