"""The schema of a session's database, one step a script. `sessions/migration.py` runs them."""
