"""What every system shares: scene files, strict reading, effects, results, tables, signals, errors."""
