"""Parts of the command line: loading of scenes and studies, sweeps of a key, comparison of results."""
