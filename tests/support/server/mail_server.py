#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A mail server that logs the accepted messages.

mail_server.py LOG [--starttls|--smtps CERTIFICATE KEY] [--user NAME PASSWORD] [--refuse ADDRESS] [--busy]
prints "READY port=N"; each message becomes a line of JSON in LOG. --busy: answers 451 to every message. The password
"busy" is answered with 454.
"""

import argparse
import asyncio
import json
import ssl
import sys

from aiosmtpd.smtp import SMTP, AuthResult

parser = argparse.ArgumentParser()
parser.add_argument("log")
parser.add_argument("--starttls", nargs=2)
parser.add_argument("--smtps", nargs=2)
parser.add_argument("--user", nargs=2)
parser.add_argument("--refuse", action="append", default=[])
parser.add_argument("--busy", action="store_true")
options = parser.parse_args()


class Handler:
    async def handle_RCPT(self, server, session, envelope, address, rcpt_options):
        if address in options.refuse:
            return "550 5.1.1 no such user here"
        envelope.rcpt_tos.append(address)
        return "250 OK"

    async def handle_DATA(self, server, session, envelope):
        if options.busy:
            return "451 4.3.0 try again later"
        with open(options.log, "a") as log:
            log.write(json.dumps({"from": envelope.mail_from, "to": envelope.rcpt_tos,
                                  "tls": session.ssl is not None, "authenticated": bool(session.authenticated),
                                  "data": envelope.content.decode("ascii")}) + "\n")
        return "250 2.0.0 taken"


def authenticate(server, session, envelope, mechanism, data):
    if data.password == b"busy":
        return AuthResult(success=False, handled=False, message="454 4.7.0 temporary authentication failure")
    good = [data.login.decode(), data.password.decode()] == options.user
    return AuthResult(success=good, handled=False)


def context_of(files):
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*files)
    return context


def session():
    more = {}
    if options.starttls:
        more = {"tls_context": context_of(options.starttls), "require_starttls": True}
    if options.user:
        # Over smtps the library does not detect TLS.
        more |= {"authenticator": authenticate, "auth_required": True,
                 "auth_require_tls": options.starttls is not None}
    return SMTP(Handler(), hostname="mail.test", **more)


async def serve():
    tls = context_of(options.smtps) if options.smtps else None
    server = await asyncio.get_running_loop().create_server(session, "127.0.0.1", 0, ssl=tls)
    print(f"READY port={server.sockets[0].getsockname()[1]}", flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)


asyncio.run(serve())
