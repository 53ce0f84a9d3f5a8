"""`ibfil live CASE`: the case, its session and its server, until Ctrl-C."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

from ...errors import CaseError
from ...running.progress import Signals
from ...screen import tell
from ...threads import one_thread_of_blas
from ..quantities import QUANTITIES
from ..web.constants import filled
from .server import served
from .session import PACE, Session
from .viewers import Viewers

if TYPE_CHECKING:
    from ...case.schema import Case


SCRIPTS = ("web/draw.js", "live/controls.js", "live/numbers.js", "live/live.js")


def live(
    case: Case,
    *,
    port: int = 0,
    colour: str = "tension",
    browse: bool = False,
    log: Callable[[str], object] = tell,
    stop: Callable[[], bool] = lambda: False,
) -> None:
    """Serve a page on which the case is played, until Ctrl-C or until ``stop`` is true. Nothing is written.

    ``colour`` is the quantity that is shown first, one of quantities.QUANTITIES; ``browse`` opens a browser. Raises
    CaseError for others, for a case that cannot be built, for a port that is taken, and where websockets is missing.
    """
    if colour not in QUANTITIES:
        raise CaseError([f"--colour: found {colour}; allowed: {', '.join(QUANTITIES)}"])
    viewers, title = Viewers(), case.title or case.file
    page = filled("live/live.html", title, json.dumps({"pace": PACE}), *SCRIPTS)
    with Signals() as signals, one_thread_of_blas(), served(page, viewers, port) as address:
        session = Session(case, viewers, colour)
        log(f"{title}\nopen {address}\nCtrl-C ends it")
        if browse:
            import webbrowser

            webbrowser.open(address)
        session.play(lambda: signals.caught or stop())
    log("ended; nothing was written")
