"""``python -m ibfil`` is the command ``ibfil``."""

import sys

from ibfil.cli import main

sys.exit(main())
