"""Cases: one file each, with what is compared, what is expected, the tolerance and its reason.

A case module holds

``TITLE``, ``SYSTEM``
    heading, and one of the systems of ``validation.common.rows``
``measure(quick, folder) -> (rows, data)``
    runs what it needs (a named small share of it where ``quick`` is true); ``data`` is saved as JSON
``tables(data) -> [Table]`` and ``draw(data) -> [(caption, Figure)]``, both optional
    what the report shows beside the rows, from the saved data alone: it never simulates
"""
