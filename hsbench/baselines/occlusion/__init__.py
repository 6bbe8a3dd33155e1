"""Occluded scene reconstruction from RGB-D and human activity, for task scene-completion."""
