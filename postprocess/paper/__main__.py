"""``python -m postprocess.paper [--only fig8 ...] [--quick] [--jobs N] [-o DIR]``: section 7 of the paper, whole."""

from __future__ import annotations

import argparse
import csv
import importlib
import os
import platform
import sys
from datetime import date
from pathlib import Path

import matplotlib

from ibfil.errors import CaseError, Interrupted
from ibfil.io.provenance import versions
from ibfil.studies.member import Member
from ibfil.studies.members import run_members

from .drawing import STYLE
from .results import HEADINGS, Row, Runs, columns, markdown, plain

PARTS = {
    "fig3": "fig3_swimmer",
    "table1": "table1_convergence",
    "fig4": "fig4_immersed",
    "fig5": "fig5_helix",
    "fig6": "fig6_diffusion",
    "fig7": "fig7_buckling",
    "fig8": "fig8_whirling",
    "fig9": "fig9_flailing",
}


def main(arguments: list[str] | None = None) -> int:
    """Run what is not done, draw, write the table. Returns the exit status: 1 where a part could not be drawn."""
    parser = argparse.ArgumentParser(prog="python -m postprocess.paper", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), help="these parts (default: all)")
    parser.add_argument("--quick", action="store_true", help="coarser and fewer runs: minutes, not hours")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time (default: 1)")
    parser.add_argument("-o", "--output", default="paper", help="folder of runs and figures (default: paper)")
    given = parser.parse_args(arguments)
    folder = Path(given.output) / ("quick" if given.quick else "full")
    try:
        return _paper(given.only, given.quick, given.jobs, folder)
    except Interrupted as cut:
        print(cut, file=sys.stderr)
        return 130
    except CaseError as error:
        print("\n".join(error.faults), file=sys.stderr)
        return 2


def _paper(parts: list[str], quick: bool, jobs: int, folder: Path) -> int:
    rows: list[Row] = []
    failed, seconds = 0, 0.0
    for part in parts:
        module = importlib.import_module(f".{PARTS[part]}", __package__)
        members: list[Member] = module.members(quick)
        print(f"{part}: {len(members)} runs")
        runs = Runs(run_members(members, folder, jobs=jobs), folder)
        try:
            with matplotlib.rc_context(STYLE):
                figure, found = module.draw(runs, quick)
                figure.savefig(folder / f"{PARTS[part]}.png", dpi=130)
            rows += found
            seconds += runs.seconds()
            print(plain(found), end="\n\n")
        except (KeyError, CaseError) as missing:  # a run there is no file of: told above, and why
            failed += 1
            print(f"{part}: cannot be drawn without {missing}", file=sys.stderr)
        finally:
            runs.close()
    print(plain(rows))
    _write(rows, seconds, quick, folder)
    return 1 if failed else 0


def _write(rows: list[Row], seconds: float, quick: bool, folder: Path) -> None:
    """The table as CSV and Markdown, with where it comes from."""
    with (folder / "table.csv").open("w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out)
        writer.writerow(HEADINGS)
        writer.writerows(columns(row) for row in rows)
    message = ", ".join(f"{name} {version}" for name, version in versions().items())
    load = f"load average {os.getloadavg()[2]:.0f} on {os.cpu_count()} cores" if hasattr(os, "getloadavg") else ""
    machine = f"{platform.system()} {platform.machine()}, one thread a run, {load}"
    head = f"# Section 7 of the paper, {'quick' if quick else 'full'} form\n\n{date.today()}; {message}; {machine}.\n\n"
    tail = f"\nWall time of all runs: {seconds / 60:.0f} minutes.\n"
    (folder / "table.md").write_text(head + markdown(rows) + tail, encoding="utf-8")
    print(f"\n{folder / 'table.md'}, {folder / 'table.csv'}")


if __name__ == "__main__":
    sys.exit(main())
