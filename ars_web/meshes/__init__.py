"""Meshes of objects in: files and polygons, read and made closed. What they are kept as is the sessions' own."""
