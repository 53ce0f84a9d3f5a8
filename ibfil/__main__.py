"""``python -m ibfil`` is the command ``ibfil``; workers of MPI executors load this file, too, by another name."""

import sys

from ibfil.commands.main import main

if __name__ == "__main__":
    sys.exit(main())
