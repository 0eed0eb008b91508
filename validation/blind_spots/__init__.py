"""Blind spots: which rows and tests notice that the output of a shared function is 1 % off.

Engines that share a function agree about it whatever it says. So each function that more than one side of a comparison
shares (``shared``) is spoiled (``spoiling``) in a process of its own (``probe``), which runs again the rows and tests
that call it (``tracing``). ``table`` keeps what noticed; what nothing independent notices is told as not covered.
"""
