"""Helpers close to the machine: compilation, room on the stack, threads, the processor's clock."""
