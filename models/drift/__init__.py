"""Why a force-excited vehicle runs away: stochastic theory, growth of errors, and what a remedy is worth."""
