"""Scores as pure functions of arrays, one module per subject; each module's docstring is its specification."""
