"""Boards: entries on disk, ranks within a track, tables derived from them."""

from hsbench.leaderboard.entry import Entry, read_entries, read_entry, write_entry
from hsbench.leaderboard.ranking import COLUMNS, Ranked, Table, rank
from hsbench.leaderboard.text import markdown

__all__ = ["COLUMNS", "Entry", "Ranked", "Table", "markdown", "rank", "read_entries", "read_entry", "write_entry"]
