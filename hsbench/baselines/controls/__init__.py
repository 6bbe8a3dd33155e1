"""Simple methods of every task with activity, and the controls they and all others are compared with."""
