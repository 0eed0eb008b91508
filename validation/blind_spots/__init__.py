"""Audit for blind spots: which report rows and tests notice that the output of a shared function is 1 % wrong.

Engines that share a function agree about it whatever it says. So each function that more than one side of a comparison
shares (``shared``) is spoiled (``spoiling``) in a process of its own (``probe``), which runs again the rows and tests
that call it. ``table`` saves which of them notice the fault; a function whose fault no independent check notices is
listed as not covered.
"""
