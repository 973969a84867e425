"""The program ``holonom``. It starts without NumPy, which the package ``holonom`` imports."""

import signal
import sys
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec


def main() -> None:
    """Does what the command line of this process asks for, and ends it with the exit code."""
    package = find_spec("holonom")
    folders = list(package.submodule_search_locations or []) if package is not None else []
    core = sys.modules.get("holonom._core")
    if core is None:
        found = PathFinder.find_spec("holonom._core", folders)
        if found is None or found.loader is None:
            sys.exit("the package holonom has no compiled part: install it again")
        core = module_from_spec(found)
        found.loader.exec_module(core)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)  # the program has handlers of its own
    sys.exit(core.main(["holonom", *sys.argv[1:]], folders[0]))
