"""Opens a page from its file in a browser without a window or a network, and performs steps.

python3 drive_page.py PAGE.html STEPS.json OUTPUT

STEPS.json is a list of steps: {"evaluate": JavaScript} for its value, {"picture": NAME} for a PNG
in the folder OUTPUT, {"key": NAME} for a press, {"wait": JavaScript} until it is true,
{"screen": [width, height, scale]}, {"media": {feature: value}}, {"block_webgl": true} and
{"open": true}.
OUTPUT/report.json then has the values, the console's messages, and the requests.
The browser is driven through a pipe, so that only Python's standard library is needed.
"""

from __future__ import annotations

import base64
import itertools
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from draw_page import BROWSER

TIMEOUT_SECONDS = 180.0
NO_WEBGL = """HTMLCanvasElement.prototype.getContext = new Proxy(
  HTMLCanvasElement.prototype.getContext,
  { apply: (real, self, [kind, ...rest]) => kind.startsWith('webgl') ? null
      : Reflect.apply(real, self, [kind, ...rest]) });"""


class Browser:
    """One page in Chromium. console_messages: errors and warnings; requests: the addresses that it
    requested."""

    def __init__(self, profile: str) -> None:
        to_browser, self._out = os.pipe()
        self._in, from_browser = os.pipe()
        command = [*BROWSER, f"--user-data-dir={profile}", "--remote-debugging-pipe"]

        def connect_pipes() -> None:
            """Chromium reads from 3 and writes to 4."""
            ends = [os.dup(to_browser), os.dup(from_browser)]
            for end, number in zip(ends, (3, 4), strict=True):
                os.dup2(end, number)

        self.process = subprocess.Popen(
            [*command, "about:blank"],
            preexec_fn=connect_pipes,
            close_fds=False,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_browser)
        os.close(from_browser)
        self.console_messages: list[str] = []
        self.requests: list[str] = []
        self._message_ids, self._buffer = itertools.count(1), b""
        targets = self.request("Target.getTargets")["targetInfos"]
        (page,) = (each["targetId"] for each in targets if each["type"] == "page")
        self._session = self.request("Target.attachToTarget", targetId=page, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.request(f"{domain}.enable")
        self.request("Network.emulateNetworkConditions", offline=True, latency=0,
                 downloadThroughput=0, uploadThroughput=0)  # fmt: skip

    _session: str | None = None

    def request(self, method: str, **parameters: Any) -> dict[str, Any]:
        number = next(self._message_ids)
        message = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            reply = self._read_message()
            if reply.get("id") == number:
                if "error" in reply:
                    raise RuntimeError(f"{method}: {reply['error']['message']}")
                return reply["result"]
            self._record_event(reply)

    def value(self, script: str) -> Any:
        result = self.request("Runtime.evaluate", expression=script, returnByValue=True,
                          awaitPromise=True)  # fmt: skip
        if "exceptionDetails" in result:
            raise RuntimeError(f"{script}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def wait(self, script: str) -> None:
        end = time.monotonic() + TIMEOUT_SECONDS
        while not self.value(script):
            if time.monotonic() > end:
                raise RuntimeError(f"never came: {script}; {self.console_messages}")
            time.sleep(0.1)

    def picture(self, path: Path) -> None:
        path.write_bytes(base64.b64decode(self.request("Page.captureScreenshot")["data"]))

    def _read_message(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            part = os.read(self._in, 1 << 16)
            if not part:
                raise RuntimeError("the browser has ended")
            self._buffer += part
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def _record_event(self, event: dict[str, Any]) -> None:
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.console_messages.append(str(parameters["exceptionDetails"]))
        elif method == "Log.entryAdded":
            self.console_messages.append(parameters["entry"]["text"])
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in (
            "error",
            "warning",
            "assert",
        ):
            self.console_messages.append(str([each.get("value") for each in parameters["args"]]))
        elif method == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"][:200])


def perform(browser: Browser, step: dict[str, Any], page: Path, output: Path) -> Any:
    ((name, argument),) = step.items()
    if name == "open":
        browser.request("Page.navigate", url=page.resolve().as_uri())
        browser.wait("['ready', 'failed'].includes(document.documentElement?.dataset.state)")
    elif name == "evaluate":
        return browser.value(argument)
    elif name == "wait":
        browser.wait(argument)
    elif name == "picture":
        browser.value(
            "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )
        browser.picture(output / argument)
    elif name == "key":
        for kind in ("keyDown", "keyUp"):
            browser.request("Input.dispatchKeyEvent", type=kind, key=argument)
    elif name == "screen":
        width, height, scale = argument
        browser.request("Emulation.setDeviceMetricsOverride", width=width, height=height,
                    deviceScaleFactor=scale, mobile=width < 600)  # fmt: skip
    elif name == "media":
        features = [{"name": each, "value": value} for each, value in argument.items()]
        browser.request("Emulation.setEmulatedMedia", features=features)
    elif name == "block_webgl":
        browser.request("Page.addScriptToEvaluateOnNewDocument", source=NO_WEBGL)
    else:
        raise ValueError(f"no such step: {name}")
    return None


def main(page: Path, steps: Path, output: Path) -> int:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(profile)
        try:
            step_list = json.loads(steps.read_text(encoding="utf-8"))
            values = [perform(browser, step, page, output) for step in step_list]
        finally:
            browser.process.kill()
            browser.process.wait()
    report = {
        "values": values,
        "complaints": browser.console_messages,
        "requests": browser.requests,
    }
    (output / "report.json").write_text(json.dumps(report), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:])))
