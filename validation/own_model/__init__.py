"""Model files in MJCF and URDF that the validation of ``twinrig twin`` reads, and faults to plant in them."""
