"""``python -m ibfil`` is the command ``ibfil``."""

import sys

from ibfil.commands.main import main

sys.exit(main())
