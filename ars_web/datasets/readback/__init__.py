"""Datasets read back as their users would, and compared with the session they were made from."""
