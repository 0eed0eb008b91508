"""What a ride scene can do without, one file each: found(held) gives the effects that its vehicle and road hold.

An effect says what it leaves out, and which others must be left out with it or may not be (``held.Effect``). A new file
in this folder is a new effect.
"""
