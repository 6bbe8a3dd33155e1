"""hsbench measures what watching people reveals about a room."""

__version__ = "0.1.0"
