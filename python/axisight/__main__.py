"""``python -m axisight``: the command ``axisight``."""

from axisight.cli import main

if __name__ == "__main__":
    main()
