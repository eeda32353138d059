"""Meshes of objects in: files, read and made closed. What they are kept as is the sessions' own."""
