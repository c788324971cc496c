#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""An HTTP server that answers as commanded and logs the requests.

web_server.py LOG [CERTIFICATE KEY]   prints "READY port=N"; each request becomes a line of JSON in LOG

Commands on standard input, each answered with OK:
  answer CODE...   codes of the next requests, in turn; the last one stays. `hang`: no answer; 429:N: with
                   Retry-After: N
"""

import http.server
import json
import ssl
import sys
import threading
import time

answers = ["200"]
lock = threading.Lock()


class Handler(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        with lock:
            answer = answers.pop(0) if len(answers) > 1 else answers[0]
            with open(sys.argv[1], "a") as log:
                entry = {"path": self.path, "headers": {k.lower(): v for k, v in self.headers.items()},
                         "body": body.decode(), "answer": answer}
                log.write(json.dumps(entry) + "\n")
        if answer == "hang":
            time.sleep(3600)
        code, _, wait = answer.partition(":")
        self.send_response(int(code))
        if wait:
            self.send_header("Retry-After", wait)
        if code == "302":
            self.send_header("Location", "/elsewhere")
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_):
        pass


server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
if len(sys.argv) > 2:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(sys.argv[2], sys.argv[3])
    server.socket = context.wrap_socket(server.socket, server_side=True)
threading.Thread(target=server.serve_forever, daemon=True).start()
print(f"READY port={server.server_address[1]}", flush=True)
for line in sys.stdin:
    with lock:
        answers = line.split()[1:]
    print("OK", flush=True)
