"""Baselines: the pipelines of the source and their comparators, as plain steps, predictions on disk before scores."""
