"""One script a step, numbered; once released a step is never changed."""
