"""Outlines of objects in photographs: found by a segmenter, carried to further frames, made into boxes."""
