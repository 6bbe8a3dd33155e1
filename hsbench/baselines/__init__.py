"""Baselines: the pipelines of the source and their comparators, as plain steps. Predictions lie on disk before scoring."""
