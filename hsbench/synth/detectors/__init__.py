"""Simulated pose detectors: what a Kinect or a heatmap detector would report of true poses."""

from hsbench.synth.detectors.config import PRESETS, DetectorConfig, detector
from hsbench.synth.detectors.observe import observe
from hsbench.synth.detectors.occluders import Occluders

__all__ = ["PRESETS", "DetectorConfig", "Occluders", "detector", "observe"]
