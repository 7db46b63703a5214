"""Serves its own folder to a browser without a window, and stores what the page posts.

python3 draw_page.py [SECONDS]: what index.html posts to NAME becomes the file NAME, until it posts
to "done". Exit code 1, with the reason, if it posts one to "failed", or is not done after SECONDS.
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
TIMEOUT_SECONDS = 120.0
# SwiftShader: WebGL on the processor
BROWSER = ("chromium", "--headless=new", "--no-sandbox", "--use-angle=swiftshader")
BROWSER += ("--enable-unsafe-swiftshader", "--disable-dev-shm-usage")


class Handler(http.server.SimpleHTTPRequestHandler):
    """Serves files, and stores what index.html posts."""

    problem: str | None = "the browser never answered"
    finished = threading.Event()

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        name = self.path.strip("/")
        if name in ("done", "failed"):
            Handler.problem = None if name == "done" else body.decode()
            Handler.finished.set()
        else:
            (FOLDER / Path(name).name).write_bytes(body)
        self.send_response(204)
        self.end_headers()

    def log_message(self, format: str, *arguments: object) -> None:
        """Silent: the page posts failures."""


def main(seconds: float = TIMEOUT_SECONDS) -> int:
    handler = functools.partial(Handler, directory=str(FOLDER))
    server = http.server.ThreadingHTTPServer(("localhost", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://localhost:{server.server_port}/index.html"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [*BROWSER, f"--user-data-dir={profile}", "--remote-debugging-port=0", address]
        browser = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            Handler.finished.wait(seconds)
        finally:
            browser.kill()
            browser.wait()
    if Handler.problem is not None:
        print(Handler.problem, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*map(float, sys.argv[1:])))
