"""The members, numbers and tables that studies share, and who measured them."""

from __future__ import annotations

import csv
import json
import math
import os
import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import CaseError
from ..io.overwriting import replacing
from .member import Member
from .settings import Setting, source

if TYPE_CHECKING:
    import numpy as np

    from ..io.reader import RunFile
    from ..observables.observers import Summary


def study_members(case: str, overrides: Sequence[str], settings: Iterable[Setting]) -> list[Member]:
    """Return a member for each setting of a case.

    Raises CaseError where the case, so overridden, is at fault itself, or with all settings.
    """
    whole = source(case)
    Member("case", whole, tuple(overrides)).resolved()
    members = [Member(one.name, whole, (*overrides, *one.overrides)) for one in settings]
    faults: list[str] = []
    for member in members:
        try:
            member.resolved()
            return members
        except CaseError as error:
            faults += error.faults
    raise CaseError(list(dict.fromkeys(faults)))


def summaries_of(run: RunFile) -> dict[str, Summary]:
    """The number of each observable of a run, with its standard error where it has one."""
    from ..observables.factory import numbers_of

    return numbers_of(run.case, run.time, run.observables)


def observed(run: RunFile) -> dict[str, np.ndarray]:
    """The number () or vector (3,) of each observable of a run."""
    import numpy as np

    return {name: np.asarray(one.value, float) for name, one in summaries_of(run).items()}


def numbers(run: RunFile) -> dict[str, float]:
    """The same with a vector as NAME_x, NAME_y, NAME_z, and copies as NAME_000, NAME_001 ..."""
    return {key: value for key, (value, _) in numbers_with_errors(run).items()}


def numbers_with_errors(run: RunFile) -> dict[str, tuple[float, float | None]]:
    """The same, each with its standard error; None where it has none."""
    import numpy as np

    from ..observables.copies import number_parts

    out: dict[str, tuple[float, float | None]] = {}
    for name, one in summaries_of(run).items():
        value = np.asarray(one.value, float)
        error = [None] * value.size if one.error is None else np.atleast_1d(one.error).tolist()
        for i, (part, number) in enumerate(number_parts(run.case, name, value).items()):
            out[f"{name}_{part}" if part else name] = float(number), error[i]
    return out


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows under the union of their columns; numbers with all digits, what is not there empty."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out)
        writer.writerow(columns)
        writer.writerows([_cell(row.get(key)) for key in columns] for row in rows)


def _cell(value: Any) -> str:
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)


def shown(value: Any, digits: int = 4) -> str:
    """A cell for the eye."""
    return f"{value:.{digits}g}" if isinstance(value, float) else "" if value is None else str(value)


def with_bar(value: float, bar: float | None, sign: str = "") -> str:
    """A number with as many digits as its bar leaves known, and the bar with two; ``sign`` "+" writes both."""
    if bar is None or not 0 < bar < float("inf"):
        return f"{value:{sign}.5g}" + ("" if not bar else " +- not known")
    decimals = 1 - math.floor(math.log10(bar))
    if -3 <= decimals <= 8:
        return f"{value:{sign}.{max(decimals, 0)}f} +- {bar:.{max(decimals, 0)}f}"
    size = max(abs(value), bar)
    return f"{value:{sign}.{max(decimals + math.floor(math.log10(size)), 0)}e} +- {bar:.1e}"


def write_json(path: Path, message: Mapping[str, Any]) -> None:
    """Write JSON; what is not finite becomes null."""
    text = json.dumps(_finite(message), indent=1, ensure_ascii=False, allow_nan=False)
    with replacing(path) as part:
        part.write_text(text + "\n", encoding="utf-8")


def refuse_strangers(folder: Path, details: str, *others: str) -> None:
    """Raise CaseError where a study would write over files that no study wrote: ``details`` says whose they are."""
    written = [details, *others, *(str(Path(name).with_suffix(".pdf")) for name in others if name.endswith(".png"))]
    there = [name for name in written if (folder / name).exists()]
    try:
        with (folder / details).open(encoding="utf-8") as file:
            ours = {"date", "versions", "machine"} <= set(json.load(file))
    except (OSError, ValueError, TypeError, RecursionError):
        ours = False
    if there and not ours:
        raise CaseError([f"{folder / there[0]}: is there, and no study wrote it: it is not replaced; take another -o"])


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value


def measured() -> dict[str, Any]:
    """When, with which versions and on what kind of machine something was measured."""
    from ..io.provenance import versions

    return {
        "date": datetime.now(UTC).date().isoformat(),
        "versions": versions(),
        "machine": f"{_processor()}, {os.cpu_count()} cores, {platform.system()}; one thread a run",
    }


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        found = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
    except OSError:
        found = None
    return found.group(1).strip() if found else platform.machine()
