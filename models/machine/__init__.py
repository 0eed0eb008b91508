"""Helpers close to the machine: compilation, memory on the stack, threads, processor time."""
