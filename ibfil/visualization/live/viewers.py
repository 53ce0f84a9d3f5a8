"""The pages that look at a played case: each is sent every text, and the newest picture when it has drawn the last."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Any, Protocol


class Line(Protocol):
    """A line to one page."""

    def send(self, message: str | bytes) -> None:
        """Send a text, or a picture."""
        ...


class Viewer:
    """One page. ``serve`` sends in the page's own pace, in a thread of its own; the others only leave things here."""

    def __init__(self, line: Line) -> None:
        self._line, self._news = line, threading.Condition()
        self._texts: deque[str] = deque()
        self._picture: bytes | None = None
        self._ready, self._gone = True, False

    def tell(self, text: str) -> None:
        """A text to be sent, in turn."""
        with self._news:
            self._texts.append(text)
            self._news.notify()

    def show(self, picture: bytes | None) -> None:
        """The picture to be sent next, in place of any that waits."""
        with self._news:
            self._picture = picture
            self._news.notify()

    def drawn(self) -> None:
        """The page has drawn the last picture."""
        with self._news:
            self._ready = True
            self._news.notify()

    def leave(self) -> None:
        """The page is gone."""
        with self._news:
            self._gone = True
            self._news.notify()

    def serve(self) -> None:
        """Send until the page is gone; raises what the line raises."""
        while True:
            with self._news:
                self._news.wait_for(lambda: self._gone or self._texts or (self._ready and self._picture is not None))
                if self._gone:
                    return
                texts, picture = list(self._texts), None
                self._texts.clear()
                if self._ready and self._picture is not None:
                    picture, self._picture, self._ready = self._picture, None, False
            for text in texts:
                self._line.send(text)
            if picture is not None:
                self._line.send(picture)


class Viewers:
    """All pages, and what they ask for. ``greet`` makes the texts and the picture that a new one begins with."""

    def __init__(self) -> None:
        self._lock = threading.Condition()
        self._viewers: set[Viewer] = set()
        self._orders: deque[dict[str, Any]] = deque()
        self._since: list[str] = []  # texts since the scene began, which a new page is told first
        self._last: bytes | None = None

    def __len__(self) -> int:
        return len(self._viewers)

    def join(self, viewer: Viewer) -> None:
        """A new page: it is told what all others know."""
        with self._lock:
            for text in self._since:
                viewer.tell(text)
            viewer.show(self._last)
            self._viewers.add(viewer)
            self._lock.notify()

    def leave(self, viewer: Viewer) -> None:
        """A page is gone."""
        with self._lock:
            self._viewers.discard(viewer)
        viewer.leave()

    def begin(self, text: str) -> None:
        """A new scene: texts and pictures of the one before are nothing to new pages."""
        with self._lock:
            self._since, self._last = [], None
            for viewer in self._viewers:
                viewer.show(None)
        self.tell(text)

    def tell(self, text: str) -> None:
        """Tell all pages, those that come later too."""
        with self._lock:
            self._since.append(text)
            for viewer in self._viewers:
                viewer.tell(text)

    def show(self, picture: bytes) -> None:
        """Show all pages a picture."""
        with self._lock:
            self._last = picture
            for viewer in self._viewers:
                viewer.show(picture)

    def ask(self, order: dict[str, Any]) -> None:
        """An order of a page."""
        with self._lock:
            self._orders.append(order)
            self._lock.notify()

    @property
    def asked(self) -> bool:
        """Whether an order waits."""
        return bool(self._orders)

    def orders(self, patience: float, also: Callable[[], bool] = lambda: False) -> list[dict[str, Any]]:
        """The orders since the last call; where there are none, after waiting for one for ``patience`` seconds at most.

        Or until ``also`` is true, which is looked at when a page joins.
        """
        with self._lock:
            self._lock.wait_for(lambda: self._orders or also(), timeout=patience)
            found = list(self._orders)
            self._orders.clear()
            return found
