"""Parameters from tracked shapes or measured numbers: `ibfil fit`."""
