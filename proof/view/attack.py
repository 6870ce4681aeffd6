"""Attacks the server of the live view, and watches its memory and its service to a good viewer meanwhile.

    cargo build --release -p taxel-view --example synthetic
    python3 proof/view/attack.py target/release/examples/synthetic

Python's standard library alone; Linux, for the memory. Exits with 1 if anything was served that should not be, or the good viewer
was kept waiting.
"""

import json
import re
import socket
import subprocess
import sys
import threading
import time

TOKEN = "0123456789abcdef0123"
LOCAL = "Host: localhost\r\n"
faults = 0


def check(is_right: bool, words: str) -> None:
    global faults
    faults += not is_right
    print(f"{'ok   ' if is_right else 'WRONG'} {words}", flush=True)


class Feeder:
    """The example, with hostile names, 500 frames a second."""

    def __init__(self, program: str) -> None:
        command = [program, f"token={TOKEN}", "show=hostile", "rate=500"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.port = int(re.search(r":(\d+)/", self.process.stdout.readline()).group(1))

    def of_proc(self, name: str) -> int:
        with open(f"/proc/{self.process.pid}/status") as status:
            return int(re.search(rf"{name}:\s+(\d+)", status.read()).group(1))

    def memory_kb(self) -> int:
        return self.of_proc("VmRSS")

    def threads(self) -> int:
        return self.of_proc("Threads")

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=20)

    def answer(self, request: str | bytes) -> bytes:
        """All that is answered to a request; what came before a reset, if it was reset."""
        answer = b""
        with self.connect() as connection:
            try:
                connection.sendall(request.encode() if isinstance(request, str) else request)
                while piece := connection.recv(65536):
                    answer += piece
            except OSError:
                pass
        return answer

    def status(self, request: str | bytes) -> str:
        answer = self.answer(request)
        return answer.split(b" ")[1].decode() if answer else "reset"

    def get(self, target: str, headers: str = LOCAL) -> str:
        return self.status(f"GET {target} HTTP/1.1\r\n{headers}\r\n")

    def post(self, body: str, headers: str = LOCAL, token: str = TOKEN) -> str:
        head = f"POST /command?token={token} HTTP/1.1\r\n{headers}Content-Length: {len(body)}\r\n\r\n"
        return self.status(head + body)

    def events(self) -> socket.socket:
        viewer = self.connect()
        viewer.sendall(f"GET /events?token={TOKEN} HTTP/1.1\r\n{LOCAL}\r\n".encode())
        return viewer


class GoodViewer(threading.Thread):
    """Reads events all the while; keeps the times at which frames came."""

    def __init__(self, feeder: Feeder) -> None:
        super().__init__(daemon=True)
        self.viewer, self.times, self.is_over = feeder.events(), [], False

    def run(self) -> None:
        rest = b""
        while not self.is_over:
            piece = self.viewer.recv(65536)
            if not piece:
                self.times.append(float("inf"))
                return
            rest += piece
            *events, rest = rest.split(b"\n\n")
            self.times += [time.monotonic()] * sum(event.startswith(b"event: frame") for event in events)

    def service(self, since: float) -> tuple[float, float]:
        """Frames a second and the longest wait in ms since a moment."""
        came, now = [moment for moment in self.times if moment >= since], time.monotonic()
        waits = [b - a for a, b in zip([since, *came], [*came, now])]
        return len(came) / (now - since), 1e3 * max(waits)


def who_is_served(feeder: Feeder) -> None:
    page = f"/?token={TOKEN}"
    check(feeder.get(page) == "200", "a local page is served")
    for host in ["evil.example", f"evil.example:{feeder.port}", "127.0.0.1.evil.example", "0.0.0.0", "", "localhost:80:80"]:
        check(feeder.get(page, f"Host: {host}\r\n") == "403", f"foreign Host {host!r} refused")
    check(feeder.get(page, "") == "400", "no Host refused")
    check(feeder.get(page, LOCAL + "Host: evil.example\r\n") == "400", "two Hosts refused")
    for origin in ["http://evil.example", "null", "https://localhost", "http://localhost.evil.example", "file://"]:
        asked = feeder.post('{"action":"zero"}', f"{LOCAL}Origin: {origin}\r\n")
        check(asked == "403", f"foreign Origin {origin!r} refused")
        check(feeder.get(f"/events?token={TOKEN}", f"{LOCAL}Origin: {origin}\r\n") == "403", f"and for events {origin!r}")
    for token in ["", "x", TOKEN[:-1], TOKEN + "0", TOKEN.upper(), "%30" + TOKEN[1:], f"x&token={TOKEN}"]:
        check(feeder.get(f"/?token={token}") == "403", f"wrong token {token!r} refused")
    check(feeder.post('{"action":"pause"}', token="wrong") == "403", "a command without the token refused")
    for path in ["/../../etc/passwd", "/..%2f..%2fetc/passwd", "//etc/passwd", "/page/page.js", "/.git/config", "http://evil.example/"]:
        check(feeder.get(f"{path}?token={TOKEN}") == "404", f"path {path} refused")
    check(feeder.status(f"DELETE {page} HTTP/1.1\r\n{LOCAL}\r\n") == "405", "another method refused")


def names(feeder: Feeder) -> None:
    page = feeder.answer(f"GET /?token={TOKEN} HTTP/1.1\r\n{LOCAL}\r\n").decode()
    check("onerror" not in page and "unsafe-inline" not in page, "names never stand in the page's HTML")
    check("<script>" not in page and "style=" not in page and "onclick" not in page, "the page has no inline script or style")
    script = feeder.answer(f"GET /page.js?token={TOKEN} HTTP/1.1\r\n{LOCAL}\r\n").decode()
    check(not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|eval\(", script), "the script writes text alone")
    with feeder.events() as viewer:
        text = b""
        while text.count(b"\n\n") < 2:
            text += viewer.recv(65536)
    data = re.search(rb"event: layout\ndata: (.*)\n\n", text).group(1)
    check("<script>" in json.loads(data)["title"], "a script in a title travels as one line of JSON")


def sizes(feeder: Feeder) -> None:
    before = feeder.memory_kb()
    refused = {"431", "reset"}
    check(feeder.status(b"GET /" + b"a" * 50_000_000) in refused, "an address of 50 MB is cut off")
    check(feeder.get("/", LOCAL + f"X: {'a' * 5_000_000}\r\n") in refused, "a header of 5 MB is cut off")
    check(feeder.get("/", LOCAL + "X: a\r\n" * 100_000) in refused, "100 000 headers are cut off")
    check(feeder.post("a" * 2_000_000) in {"413", "reset"}, "a body of 2 MB is cut off")
    huge = f"POST /command?token={TOKEN} HTTP/1.1\r\n{LOCAL}Content-Length: 99999999999999999999\r\n\r\n"
    check(feeder.status(huge) == "400", "a length beyond all numbers refused")
    check(feeder.post("[" * 1000) == "400", "deep JSON refused")
    check(feeder.post('{"action":"seek","to_s":1e999}') == "400", "a number beyond all numbers refused")
    check(feeder.status(bytes(range(256)) * 4 + b"\r\n\r\n") == "400", "bytes that are no request refused")
    check(feeder.memory_kb() - before < 4000, f"memory grew by {feeder.memory_kb() - before} kB")


def crowds(feeder: Feeder) -> None:
    idle = [feeder.connect() for _ in range(100)]
    start = time.monotonic()
    check(feeder.get(f"/?token={TOKEN}") == "200", f"100 idle connections: a page in {1e3 * (time.monotonic() - start):.0f} ms")
    time.sleep(0.3)
    check(feeder.threads() < 60, f"and {feeder.threads()} threads")
    time.sleep(4)
    check(feeder.threads() < 20, f"after 4 s they are gone: {feeder.threads()} threads")
    for connection in idle:
        connection.close()

    slow, start = [feeder.connect() for _ in range(40)], time.monotonic()
    ended = served = 0
    for letter in f"GET /?token={TOKEN} HTTP/1.1\r\nX-Slow: {'a' * 200}"[:25]:
        for connection in slow:
            try:
                connection.sendall(letter.encode())
            except OSError:
                ended += 1
        served += feeder.get(f"/?token={TOKEN}") == "200"
        time.sleep(0.2)
    check(served == 25, f"40 slow headers for {time.monotonic() - start:.0f} s: {served} of 25 pages served meanwhile")
    check(ended > 0 and feeder.threads() < 20, f"and slow headers are let go: {feeder.threads()} threads")
    for connection in slow:
        connection.close()

    viewers = [feeder.events() for _ in range(30)]
    statuses = [viewer.recv(12)[-3:] for viewer in viewers]
    check(statuses.count(b"200") == 4, f"of 30 more viewers {statuses.count(b'200')} are served (the good one is the fifth)")
    check(statuses.count(b"503") == 23, "and the rest told that there are too many")
    before = feeder.memory_kb()
    # They do not read: their threads wait, then let them go.
    start = time.monotonic()
    while feeder.threads() > 6 and time.monotonic() - start < 90:
        time.sleep(1)
    check(feeder.threads() <= 6, f"viewers that do not read are let go after {time.monotonic() - start:.0f} s")
    check(feeder.memory_kb() - before < 2000, f"memory grew by {feeder.memory_kb() - before} kB")
    for viewer in viewers:
        viewer.close()
    with feeder.events() as viewer:
        check(viewer.recv(12)[-3:] == b"200", "and their places are free")


def commands(feeder: Feeder) -> None:
    results: list[str] = []
    asks = [threading.Thread(target=lambda: results.append(feeder.post('{"action":"zero"}'))) for _ in range(100)]
    for ask in asks:
        ask.start()
    for ask in asks:
        ask.join()
    check(set(results) <= {"409", "reset"}, f"100 commands at once: {results.count('409')} answered, {results.count('reset')} reset")


def main() -> None:
    feeder = Feeder(sys.argv[1])
    try:
        good = GoodViewer(feeder)
        good.start()
        time.sleep(1)
        memory_kb = feeder.memory_kb()
        for attack in [who_is_served, names, sizes, commands, crowds]:
            start = time.monotonic()
            attack(feeder)
            time.sleep(1)
            rate, longest_ms = good.service(start)
            words = f"meanwhile, the good viewer got {rate:.0f} frames/s, waiting {longest_ms:.0f} ms at most"
            check(rate > 30 and longest_ms < 1000, words)
        grown_kb = feeder.memory_kb() - memory_kb
        check(grown_kb < 6000 and feeder.process.poll() is None, f"memory {memory_kb} kB, grown by {grown_kb} kB in the end")
        good.is_over = True
    finally:
        feeder.process.kill()
    print(f"{faults} wrong" if faults else "all right")
    sys.exit(faults > 0)


if __name__ == "__main__":
    main()
