"""How scenes of each system are priced: one file per system, found by its name.

A file has ``priced_scene(scene, quantity, engines) -> PricedScene`` (see ``models.advice.price``); quantity is None
where the user names none. A system without a file may say why, in ``NO_PRICE`` of its package."""
