"""The program: ``python -m holonom``."""

from holonom_program import main

if __name__ == "__main__":
    main()
