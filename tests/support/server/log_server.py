#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A syslog collector over TCP or TLS, with octet counting (RFC 6587).

log_server.py LOG [CERTIFICATE KEY [AUTHORITIES]]   prints "READY port=N"; each frame becomes a line of JSON in LOG.
With AUTHORITIES it requests a certificate of the client.

Commands on standard input, each answered with OK: `close` ends all connections, `deaf` stops reading, `hear` reads again.
"""

import asyncio
import json
import ssl
import sys

connections = []
hears = asyncio.Event()


async def take(reader, writer):
    connections.append(writer)
    try:
        while True:
            await hears.wait()
            length = int((await reader.readuntil(b" ")).decode())
            frame = await reader.readexactly(length)
            with open(sys.argv[1], "a") as log:
                log.write(json.dumps(frame.decode()) + "\n")
    except (asyncio.IncompleteReadError, ConnectionError):
        writer.close()


async def serve():
    hears.set()
    tls = None
    if len(sys.argv) > 2:
        tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        tls.load_cert_chain(sys.argv[2], sys.argv[3])
    if len(sys.argv) > 4:
        tls.load_verify_locations(sys.argv[4])
        tls.verify_mode = ssl.CERT_REQUIRED
    server = await asyncio.start_server(take, "127.0.0.1", 0, ssl=tls)
    print(f"READY port={server.sockets[0].getsockname()[1]}", flush=True)
    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        if line.strip() == "close":
            for writer in connections:
                writer.close()
            await asyncio.gather(*(w.wait_closed() for w in connections), return_exceptions=True)
            connections.clear()
        elif line.strip() == "deaf":
            hears.clear()
        else:
            hears.set()
        print("OK", flush=True)


asyncio.run(serve())
