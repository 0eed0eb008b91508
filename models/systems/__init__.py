"""The systems that a scene can be of: a folder each, and nothing lists them."""
