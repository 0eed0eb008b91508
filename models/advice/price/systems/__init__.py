"""Scenes of each system in the form whose accuracy can be priced: one file per system, looked up by the system's name.

A file has ``priced_scene(scene, quantity, engines) -> PricedScene`` (see ``models.advice.price``); quantity is None
where the user names none. A system without a file may say why, in ``NO_PRICE`` of its package.
"""
