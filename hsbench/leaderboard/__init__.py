"""Boards: entries on disk, ranks within a track, pages derived from them."""

from hsbench.leaderboard.entry import Entry, read_entries, read_entry, write_entry
from hsbench.leaderboard.pages import html_page, markdown
from hsbench.leaderboard.ranking import Ranked, Table, rank

__all__ = ["Entry", "Ranked", "Table", "html_page", "markdown", "rank", "read_entries", "read_entry", "write_entry"]
