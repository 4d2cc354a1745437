"""The command: `python -m bagreel`, and `bagreel` in the path."""

import sys

from . import _bagreel


def main() -> None:
    """Runs the command line and exits with its code."""
    sys.exit(_bagreel.main(["bagreel", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
