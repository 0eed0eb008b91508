"""Effects of scenes of braking, one file each: see ``models.core.scene_effects``.

Counts are those of one stop: coordinates and wheels of the vehicle, what its brakes, chambers and tyres keep, and how
many hold the controller in the loop.
"""
