"""Occluded scene reconstruction from RGB-D and human activity (METHODS 1), for task scene-completion."""
