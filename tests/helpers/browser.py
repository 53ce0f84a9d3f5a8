"""A tab of a headless Chromium, spoken to by its DevTools: what a user does with a page that a server serves."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
import time
import urllib.request
from contextlib import ExitStack
from pathlib import Path

BROWSERS = ("chromium", "chromium-headless-shell", "google-chrome", "chrome")
BROWSER = next((found for name in BROWSERS if (found := shutil.which(name))), None)


class Tab:
    """One tab; use it in a ``with``. ``profile`` is a folder for the browser's own files."""

    def __init__(self, profile: Path) -> None:
        words = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=1280,800"]
        words += [f"--user-data-dir={profile}", "--remote-debugging-port=0", "about:blank"]
        self._process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
        self._count, self.faults, self._ends = 0, [], ExitStack()

    def __enter__(self) -> Tab:
        from websockets.sync.client import connect

        for line in self._process.stderr:
            found = re.search(r"ws://(127\.0\.0\.1:\d+)/", line)
            if found:
                break
        with urllib.request.urlopen(f"http://{found.group(1)}/json", timeout=30) as answer:
            page = next(one for one in json.load(answer) if one["type"] == "page")
        self._line = self._ends.enter_context(connect(page["webSocketDebuggerUrl"], max_size=None))
        self.ask("Page.enable")
        self.ask("Runtime.enable")
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.close()
        self._process.terminate()
        self._process.wait(20)
        self._process.stderr.close()

    def ask(self, method: str, **more: object) -> dict:
        """A command of the DevTools protocol."""
        self._count += 1
        self._line.send(json.dumps({"id": self._count, "method": method, "params": more}))
        while True:
            answer = json.loads(self._line.recv(timeout=60))
            if answer.get("method") == "Runtime.exceptionThrown":
                self.faults.append(answer["params"]["exceptionDetails"].get("exception", {}).get("description", ""))
            if answer.get("id") == self._count:
                return answer.get("result", answer)

    def go(self, address: str) -> None:
        """Open a page."""
        self.ask("Page.navigate", url=address)

    def value(self, script: str) -> object:
        """The value of an expression in the page."""
        answer = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        return answer.get("result", {}).get("value")

    def until(self, script: str, patience: float = 60.0) -> object:
        """The value of an expression, as soon as it is true of the page."""
        end = time.monotonic() + patience
        while not (found := self.value(script)):
            assert time.monotonic() < end, f"{script} did not come true; faults of the page: {self.faults}"
            time.sleep(0.05)
        return found

    def picture(self) -> bytes:
        """The page as PNG."""
        return base64.b64decode(self.ask("Page.captureScreenshot")["data"])
