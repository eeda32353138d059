"""`python -m ars_web` is `ars-web`."""

from ars_web.cli import main

if __name__ == "__main__":
    main()
