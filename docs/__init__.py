"""The documentation: pages in Markdown, and modules that run their examples, write the reference and build the site.

- ``pages``: the pages, and their fenced blocks with the marks before them
- ``outputs``: runs the examples of pages and writes or compares what they print
- ``alike``: when two printed outputs say the same
- ``scene_keys``: the reference of scene keys and effects, from the models that read scenes
- ``validation_cases``: the reference of the cases of the validation report
- ``gallery``: small copies of the figures that studies draw, for the page that lists them
- ``website``: the site, built with every example run anew
"""
