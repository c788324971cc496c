#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takes one plot out of a gap report, as an SVG that stands alone.

Usage: tools/report_picture.py REPORT.html trend|residual|output > picture.svg
"""
import re
import sys

STYLE = """
text { font: 12.5px sans-serif; fill: #5b6570 } .grid line { stroke: #e7eaee } .frame { fill: none; stroke: #d5dae0 }
path { fill: none; vector-effect: non-scaling-stroke; stroke-width: 1.4; stroke-linejoin: round }
line { vector-effect: non-scaling-stroke } line.zero, line.floor { stroke: #5b6570 } line.floor { stroke-dasharray: 2 4 }
.measured { stroke: #1b1f24 } .before { stroke: #d55e00; stroke-dasharray: 7 3 } .after { stroke: #0072b2 }
.sp { stroke: #7a828c; stroke-dasharray: 6 4 } rect.located { fill: #e69f00 } rect.held { fill: #5b6570; fill-opacity: .1 }
"""
NAMES = {"measured": "measured", "before": "model as given", "after": "corrected model", "sp": "SP"}


def picture(page: str, name: str) -> str:
    begin = page.index('<svg class="plot time"', page.index(f'<figure id="{name}"'))
    # A plot holds one inner SVG, so that it ends at the second closing tag.
    end = page.index("</svg>", page.index("</svg>", begin) + 1) + len("</svg>")
    svg = page[begin:end]
    height = int(re.search(r'viewBox="0 0 1000 (\d+)"', svg).group(1))
    body = svg[svg.index(">") + 1:]
    legend, x = "", 62
    for curve in re.findall(r'data-curve="(\w+)"', svg):
        legend += (f'<line class="{curve}" x1="{x}" x2="{x + 28}" y1="-12" y2="-12" stroke-width="2"/>'
                   f'<text x="{x + 34}" y="-8">{NAMES.get(curve, curve)}</text>')
        x += 170
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 -24 1000 {height + 24}" width="1000" '
            f'height="{height + 24}"><style>{STYLE}</style>'
            f'<rect y="-24" width="1000" height="{height + 24}" fill="#fff"/>{legend}{body}\n')


def main() -> int:
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 64
    try:
        with open(sys.argv[1], encoding="utf-8") as file:
            sys.stdout.write(picture(file.read(), sys.argv[2]))
    except (OSError, ValueError) as error:
        print(f"{sys.argv[1]}: no such plot: {error}", file=sys.stderr)
        return 65
    return 0


sys.exit(main())
