"""``python -m hsbench`` is the command ``hsbench``."""

from hsbench.cli.main import main

if __name__ == "__main__":  # worker processes import this file, too
    main()
