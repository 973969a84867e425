"""The program: ``python -m holonom`` and ``holonom``."""

import signal
import sys
from os.path import dirname

from . import _core


def main() -> None:
    """Does what the command line of this process asks for, and ends it with the exit code."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)  # the program has handlers of its own
    sys.exit(_core.main(["holonom", *sys.argv[1:]], dirname(__file__)))


if __name__ == "__main__":
    main()
