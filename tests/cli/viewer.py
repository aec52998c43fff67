"""A running viewer, as its page talks to it."""

import contextlib
import http.client
import json
import signal
import subprocess
import time

from support import SURFLECT

TAB = "00112233445566ff"


class Viewer:
    """A running `surflect view`, for as long as a block runs or until it is killed."""

    def __init__(self, *arguments, folder):
        self.log = folder / "view.log"
        with open(self.log, "w") as log:
            self.process = subprocess.Popen([SURFLECT, "view", *map(str, arguments)], cwd=folder, stderr=log,
                                            stdout=subprocess.DEVNULL)
        for _ in range(600):
            lines = [line for line in self.log.read_text().splitlines() if line.startswith("http://")]
            if lines:
                break
            if self.process.poll() is not None:
                raise AssertionError(f"surflect view has ended: {self.log.read_text()}")
            time.sleep(0.05)
        self.url = lines[0]
        self.port = int(self.url.split(":")[2].split("/")[0])
        self.token = self.url.partition("token=")[2]

    def request(self, method, path, body=None, headers=None, tab=TAB, timeout=60):
        """Status, body and headers of an answer. `headers` replace those that a page sends; None leaves one out."""
        sent = {"Host": f"127.0.0.1:{self.port}", "X-Surflect-Token": self.token, "X-Surflect-Tab": tab, **(headers or {})}
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout)
        with contextlib.closing(connection):
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in sent.items():
                if value is not None:
                    connection.putheader(name, value)
            data = body if isinstance(body, bytes) else b"" if body is None else json.dumps(body).encode()
            if method != "GET":
                connection.putheader("Content-Length", str(len(data)))
            connection.endheaders(data if method != "GET" else None)
            answer = connection.getresponse()
            return answer.status, answer.read(), dict(answer.getheaders())

    def get(self, path, **options):
        return self.request("GET", path, **options)

    def post(self, path, body, **options):
        return self.request("POST", path, body, **options)

    def ask(self, path, body):
        """The JSON of an answer that must be given."""
        status, answer, _ = self.post(path, body)
        if status != 200:
            raise AssertionError(f"{path}: {status} {answer[:300]}")
        return json.loads(answer)

    def end(self):
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(30)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()


def shot_of(start, **values):
    """A request for the middle frame of the script, at its own size."""
    return {"number": 1, "pane": "a", "model": 0, "doc": start["doc"], "frame": 2, "size": start["doc"]["output"]["size"],
            "quality": "full", "options": {}, "show": "color", "exposure": 0, "white": None, "tone": "none",
            "background": [0, 0, 0], **values}


def error_of(answer):
    return json.loads(answer[1])["error"]
