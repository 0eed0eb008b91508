"""Bodies in a tree, their motion and the forces between them, compiled once for every engine."""
