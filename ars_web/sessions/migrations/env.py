"""Alembic's entry: runs the steps on the connection, and within the transaction, that `migration.py` hands over."""

from alembic import context

context.configure(connection=context.config.attributes["connection"], transactional_ddl=True)
context.run_migrations()
