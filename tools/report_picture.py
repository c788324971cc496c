#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Extracts one plot of a gap report as a separate SVG.

Usage: tools/report_picture.py REPORT.html trend|residual|output|phase > picture.svg
"""
import re
import sys


def picture(page: str, name: str) -> str:
    """Returns the still picture of a figure, which the page shows without scripts."""
    still = page.index('<div class="still">', page.index(f'<figure id="{name}"'))
    begin = page.index("<svg", still)
    depth = 0
    for tag in re.finditer(r"<(/?)svg\b", page[begin:]):  # the curves are a drawing within the drawing
        depth += -1 if tag[1] else 1
        if depth == 0:
            return page[begin:begin + tag.end()] + ">\n"
    raise ValueError


def main() -> int:
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 64
    try:
        with open(sys.argv[1], encoding="utf-8") as file:
            sys.stdout.write(picture(file.read(), sys.argv[2]))
    except ValueError:
        print(f"{sys.argv[1]}: no plot '{sys.argv[2]}'", file=sys.stderr)
        return 65
    except OSError as error:
        print(f"{sys.argv[1]}: {error.strerror}", file=sys.stderr)
        return 74
    return 0


sys.exit(main())
