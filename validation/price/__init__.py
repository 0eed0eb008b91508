"""Work-precision runner: what accuracy costs.

``problems/`` holds one file per problem; ``runner`` measures settings, ``curves`` reads them, ``rows``,
``tables`` and ``figure`` show them, ``force_calls`` counts from outside, ``speed`` times callbacks.
"""
