"""Training sets out: samples, splits, shards, and one writer a format."""
