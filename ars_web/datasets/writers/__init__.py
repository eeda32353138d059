"""Dataset formats: one writer a format, all of them values of `writer.Writer`."""
