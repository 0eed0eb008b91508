"""Models in MJCF and URDF of ours, and what is planted in them."""
