"""The annotation session, the only truth: what it holds, how it changes, how it is kept."""
