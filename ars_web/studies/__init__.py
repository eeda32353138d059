"""Studies of a session: its coverage, where to look next, its labels beside a person's, and a report of it all."""
