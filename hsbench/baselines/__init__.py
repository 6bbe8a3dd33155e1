"""Baselines: the pipelines of the source and their comparators, as plain steps; predictions lie on disk before scoring."""
