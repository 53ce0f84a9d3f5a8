"""python -m postprocess.docs [-o DIR]: the pages into DIR (build/docs), anew, a warning being an error."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from pathlib import Path


def main() -> int:
    """Build the pages; returns the exit status, 1 after a warning of Sphinx."""
    parser = argparse.ArgumentParser(prog="python -m postprocess.docs", description=__doc__)
    parser.add_argument("-o", dest="out", metavar="DIR", type=Path, default=Path("build/docs"), help="where to")
    out: Path = parser.parse_args().out.resolve()
    if out.exists() and not (out / ".buildinfo").exists() and any(out.iterdir()):
        print(f"-o: found {out}, which holds something else; allowed: a new folder, or one of pages", file=sys.stderr)
        return 2
    try:
        from sphinx.cmd.build import build_main
    except ModuleNotFoundError:
        print("sphinx is missing: pip install 'ibfil[docs]'", file=sys.stderr)
        return 2
    os.environ["NUMBA_DISABLE_JIT"] = "1"  # compiled functions are read as the functions they are made of
    from . import sources

    shutil.rmtree(out, ignore_errors=True)
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        sources.write(source)
        words = ["-q", "-W", "--keep-going", "-n", "-j", "auto", "-c", str(Path(__file__).parent)]
        status: int = build_main([*words, "-d", str(Path(folder) / "doctrees"), str(source), str(out)])
    if status == 0:
        print(f"{len(list(out.rglob('*.html')))} pages: {out / 'index.html'}")
    return status


if __name__ == "__main__":
    sys.exit(main())
