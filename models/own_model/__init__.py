"""Models of a user, read from MJCF or URDF, built in every engine and compared with the file as MuJoCo parsed it.

A file becomes the description of ``models.vehicles.spatial``: a body without mass for every joint, along whose axis it
moves, and a body with the mass behind the last of them. From there on it is any free vehicle: the builders in
``models.engines`` and the plain equations make it. What is new here is reading, comparing and explaining.

xml_guard : what a file may ask of the parser; content : what has no equal here; reading, names, equalities,
coordinates : from MuJoCo's compiled model to the description and back; certificate, rounding : mass, forces,
accelerations at random states, and what rounding makes of them; elements, element_words, explain : the numbers and
switches of a file by name, and which of them make a difference; path, two_paths : motion over 1 s; urdf : a URDF read
without MuJoCo.
"""
