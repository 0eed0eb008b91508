"""Common parts of every system: scene files, strict reading, effects, results, tables, signals, errors."""
