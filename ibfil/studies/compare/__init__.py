"""`ibfil compare`: one scene under several fluids."""
