"""Serves this folder to a browser without a window, which draws it and sends back the picture.

python3 draw.py: writes three.png beside it; exit code 1 and the reason where that fails.
"""

from __future__ import annotations

import functools
import http.server
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

FOLDER = Path(__file__).parent
LONGEST = 120.0
# SwiftShader: WebGL on the processor
BROWSER = ("chromium", "--headless=new", "--no-sandbox", "--use-angle=swiftshader")
BROWSER += ("--enable-unsafe-swiftshader", "--disable-dev-shm-usage")


class Handler(http.server.SimpleHTTPRequestHandler):
    """Hands out files, and takes what index.html posts."""

    answer: tuple[str, bytes] = ("/failed", b"the browser never answered")
    answered = threading.Event()

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        Handler.answer = (self.path, body)
        self.send_response(204)
        self.end_headers()
        Handler.answered.set()

    def log_message(self, format: str, *arguments: object) -> None:
        """Quiet: what fails comes as an answer."""


def main() -> int:
    handler = functools.partial(Handler, directory=str(FOLDER))
    server = http.server.ThreadingHTTPServer(("localhost", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://localhost:{server.server_port}/index.html"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [*BROWSER, f"--user-data-dir={profile}", "--remote-debugging-port=0", address]
        browser = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            Handler.answered.wait(LONGEST)
        finally:
            browser.kill()
            browser.wait()
    path, body = Handler.answer
    if path != "/drawn":
        print(body.decode(), file=sys.stderr)
        return 1
    (FOLDER / "three.png").write_bytes(body)
    return 0


if __name__ == "__main__":
    sys.exit(main())
