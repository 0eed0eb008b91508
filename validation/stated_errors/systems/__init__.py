"""Random scenes of each system, found by listing."""
