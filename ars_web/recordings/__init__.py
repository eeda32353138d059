"""Tracked recordings in: one reader a format, each converting its foreign conventions here, once."""
