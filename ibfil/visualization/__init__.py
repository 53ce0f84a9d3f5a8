"""Figures, pictures, films and ParaView files of a run."""
