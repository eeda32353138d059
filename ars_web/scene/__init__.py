"""The 3D scene: one viser server a session, behind the program's one port. viser is imported nowhere else.

`server.py` is what the rest of the program is given. It does not import viser until the first scene is opened, so
that commands which show none start quickly.
"""
