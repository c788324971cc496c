#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the loops of `loopwarden-study plant` in thirty layouts of historians, one file per layout.

lab/plant_study/layouts.py PLANT OUT    PLANT: folder of the exports, OUT: folder for the thirty files and OUT.tags.csv
"""
import csv
import datetime
import gzip
import io
import math
import pathlib
import sys
import zipfile
from xml.sax.saxutils import escape

START = datetime.datetime(2026, 3, 1, 10, tzinfo=datetime.timezone.utc)
EPOCH = datetime.datetime(1899, 12, 30, tzinfo=datetime.timezone.utc)  # of spreadsheets
MONTHS = "Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec".split()
DAYS = "Mon Tue Wed Thu Fri Sat Sun".split()


class Loop:
    def __init__(self, tag, period_s, pv, co, sp):
        self.tag, self.period_s, self.pv, self.co, self.sp = tag, period_s, pv, co, sp

    def moments(self):
        return [START + datetime.timedelta(seconds=k * self.period_s) for k in range(len(self.pv))]

    def rows(self):
        return zip(self.moments(), self.pv, self.sp, self.co)


def excel(t):
    return f"{(t - EPOCH).total_seconds() / 86400:.9f}"


def comma(value, digits=3):
    return f"{value:.{digits}f}".replace(".", ",")


def wide(loop, heads, time, separator=",", value=lambda v: f"{v:.3f}", extra=()):
    """One column per signal. `heads`: of time, PV, SP and CO. `extra`: more cells."""
    lines = [separator.join(heads)]
    for t, *values in loop.rows():
        lines.append(separator.join([time(t), *(value(v) for v in values), *extra]))
    return "\n".join(lines) + "\n"


def long(loop, heads, names, row, separator=","):
    """One value per row. `row`: cells of (name, time, value)."""
    lines = [separator.join(heads)]
    for t, *values in loop.rows():
        lines += [separator.join(row(name, t, value)) for name, value in zip(names, values)]
    return "\n".join(lines) + "\n"


def by_exception(loop, heads, names, row, share):
    """Stores a value only if it moved by `share` of its span."""
    lines = [",".join(heads)]
    last = {}
    for t, *values in loop.rows():
        for name, column, value in zip(names, (loop.pv, loop.sp, loop.co), values):
            span = max(column) - min(column)
            if name not in last or abs(value - last[name]) > share * span:
                last[name] = value
                lines.append(",".join(row(name, t, value)))
    return "\n".join(lines) + "\n"


def swinging_door(times, values, deviation):
    """Returns the indices that a swinging door keeps."""
    kept, low, high, first = [0], -math.inf, math.inf, 0
    for k in range(1, len(values)):
        dt = times[k] - times[first]
        low = max(low, (values[k] - deviation - values[first]) / dt)
        high = min(high, (values[k] + deviation - values[first]) / dt)
        if low > high:
            first = k - 1
            kept.append(first)
            dt = times[k] - times[first]
            low, high = (values[k] - deviation - values[first]) / dt, (values[k] + deviation - values[first]) / dt
    return kept + [len(values) - 1]


def by_door(loop, names):
    lines = ["Tag,Timestamp,Value"]
    moments = loop.moments()
    seconds = [(t - START).total_seconds() for t in moments]
    for name, column in zip(names, (loop.pv, loop.sp, loop.co)):
        span = max(column) - min(column) or 1.0
        for k in swinging_door(seconds, column, 0.005 * span):
            lines.append(f"{name},{moments[k]:%Y-%m-%d %H:%M:%S},{column[k]:.4f}")
    return "\n".join(lines) + "\n"


def workbook(rows):
    cells = []
    for row in rows:
        cells.append("<row>" + "".join(
            f'<c t="inlineStr"><is><t>{escape(c)}</t></is></c>' if isinstance(c, str) else f"<c><v>{c:.9f}</v></c>" for c in row) + "</row>")
    sheet = '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>' + "".join(cells) + "</sheetData></worksheet>"
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as z:
        z.writestr("[Content_Types].xml", '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="xml" ContentType="application/xml"/>'
                   '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/></Types>')
        z.writestr("_rels/.rels", '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="r1" '
                   'Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/officeDocument" Target="xl/workbook.xml"/></Relationships>')
        z.writestr("xl/workbook.xml", '<workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main" '
                   'xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships"><sheets><sheet name="Trend" sheetId="1" r:id="r1"/></sheets></workbook>')
        z.writestr("xl/_rels/workbook.xml.rels", '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="r1" '
                   'Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet" Target="worksheets/sheet1.xml"/></Relationships>')
        z.writestr("xl/worksheets/sheet1.xml", sheet)
    return out.getvalue()


def zipped(name, data):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as z:
        z.writestr(name, data)
    return out.getvalue()


def pairs(loop, names, time):
    lines = ["\t".join(f"{n}\t" for n in names), "\t".join("Timestamp\tValue" for _ in names)]
    for t, *values in loop.rows():
        lines.append("\t".join(f"{time(t)}\t{v:.3f}" for v in values))
    return "\n".join(lines) + "\n"


def annotated(loop):
    lines = ["#group,false,false,true,true,false,false,true,true", "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,string",
             "#default,_result,,,,,,,", ",result,table,_start,_stop,_time,_value,_field,_measurement"]
    for table, (field, column) in enumerate(zip(("pv", "sp", "op"), (loop.pv, loop.sp, loop.co))):
        for t, v in zip(loop.moments(), column):
            lines.append(f",,{table},2026-03-01T00:00:00Z,2026-03-02T00:00:00Z,{t:%Y-%m-%dT%H:%M:%SZ},{v:.4f},{field},{loop.tag}")
    return "\r\n".join(lines) + "\r\n"


def line_protocol(loop):
    return "".join(f"{loop.tag} pv={pv:.4f},sp={sp:.4f},op={co:.4f} {int(t.timestamp())}000000000\n" for t, pv, sp, co in loop.rows())


def iso(t):
    return f"{t:%Y-%m-%dT%H:%M:%SZ}"


def am_pm(t):
    return f"{t.month}/{t.day}/{t.year} {(t.hour + 11) % 12 + 1}:{t:%M:%S} {'AM' if t.hour < 12 else 'PM'}"


def thousands(loop):
    lines = ["Time," + ",".join(signal_names("", loop.tag))]
    lines += [f'{t:%Y-%m-%d %H:%M:%S},"{pv * 100:,.1f}","{sp * 100:,.1f}",{co:.2f}' for t, pv, sp, co in loop.rows()]
    return "\n".join(lines) + "\n"


def signal_names(before, tag, pv=".PV", sp=".SP", co=".OP"):
    return [before + tag + pv, before + tag + sp, before + tag + co]


# File name and content of each layout. Text is written in UTF-8.
LAYOUTS = [
    ("wide_iso.csv", lambda l: wide(l, ["Timestamp", *signal_names("", l.tag)], iso)),
    ("german.csv", lambda l: wide(l, ["Zeit", *signal_names("", l.tag)], lambda t: f"{t:%d.%m.%Y %H:%M:%S}", ";", comma)),
    ("datalink_pairs.txt", lambda l: pairs(l, signal_names("", l.tag), lambda t: f"{t.day:02}-{MONTHS[t.month - 1]}-{t:%y %H:%M:%S}")),
    ("datalink_wide.csv", lambda l: wide(l, ["", *signal_names("\\\\PISRV01\\", l.tag)], lambda t: f"{t.day:02}-{MONTHS[t.month - 1]}-{t:%Y %H:%M:%S}")),
    ("ip21.csv", lambda l: long(l, ["NAME", "IP_TREND_TIME", "IP_TREND_VALUE", "IP_TREND_QSTATUS"], signal_names("", l.tag),
                                lambda n, t, v: [n, f"{t.day:02}-{MONTHS[t.month - 1].upper()}-{t:%y %H:%M:%S}.0", f"{v:.3f}", "Good"])),
    ("ignition.csv", lambda l: wide(l, ["t_stamp", *signal_names("[default]Plant/Area1/", l.tag, "/PV", "/SP", "/CV")], lambda t: f"{t:%Y-%m-%d %H:%M:%S}.000")),
    ("ignition_millis.csv", lambda l: wide(l, ["t_stamp", *signal_names("[Historian]Site/Unit 2/", l.tag, "/PV", "/SP", "/OUT")], lambda t: f"{int(t.timestamp() * 1000)}")),
    ("wincc.csv", lambda l: ("\ufeff" + long(l, ["VarName", "TimeString", "VarValue", "Validity", "Time_ms"], signal_names("", l.tag, "_PV", "_SP", "_LMN"),
                                  lambda n, t, v: [f'"{n}"', f'"{t:%d.%m.%Y %H:%M:%S}"', comma(v), "1", comma((t - EPOCH).total_seconds() / 86400 * 1e6, 4)], ";")).encode("utf-16-le")),
    ("deltav.csv", lambda l: wide(l, ["Date/Time", *signal_names("", l.tag, "/PID1/PV.CV", "/PID1/SP.CV", "/PID1/OUT.CV")], am_pm)),
    ("deltav_units.csv", lambda l: wide(l, ["Date Time", l.tag + "/PID1/PV.CV GPM", l.tag + "/PID1/SP.CV GPM", l.tag + "/PID1/OUT.CV %"], am_pm)),
    ("influx_annotated.csv", annotated),
    ("influx_lines.txt", line_protocol),
    ("workbook.xlsx", lambda l: workbook([["Time", *signal_names("", l.tag)], *([float(excel(t)), *v] for t, *v in l.rows())])),
    ("german.zip", lambda l: zipped("tag.csv", wide(l, ["Datum", *signal_names("", l.tag)], lambda t: f"{t:%d.%m.%Y %H:%M:%S}", ";", comma))),
    ("packed.csv.gz", lambda l: gzip.compress(wide(l, ["time", *signal_names("", l.tag)], iso).encode())),
    ("exception.csv", lambda l: by_exception(l, ["Tag", "Time", "Value", "Status"], signal_names("dcs.", l.tag),
                                             lambda n, t, v: [n, iso(t), f"{v:.4f}", "Good"], 0.002)),
    ("door.csv", lambda l: by_door(l, signal_names("", l.tag))),
    ("excel_days.csv", lambda l: wide(l, ["Date", *signal_names("", l.tag)], excel)),
    ("epoch.csv", lambda l: wide(l, ["epoch_s", *signal_names("", l.tag)], lambda t: str(int(t.timestamp())))),
    ("units_row.tsv", lambda l: wide(l, ["Time", *signal_names("", l.tag)], lambda t: f"{t:%Y-%m-%d %H:%M:%S}", "\t").replace("\n", "\n\tm3/h\tm3/h\t%\n", 1)),
    ("preamble.csv", lambda l: "Report;Trend\nServer;HIST01\n\n" + wide(l, ["Time", *signal_names("", l.tag)], lambda t: f"{t:%Y-%m-%d %H:%M:%S}", ";")),
    ("date_and_time.csv", lambda l: wide(l, ["Date,Time", *signal_names("", l.tag)], lambda t: f"{t:%Y-%m-%d,%H:%M:%S}")),
    ("phd.csv", lambda l: long(l, ["Tagname", "Timestamp", "Value", "Confidence"], signal_names("", l.tag),
                               lambda n, t, v: [n, f"{t:%m/%d/%Y %H:%M:%S}", f"{v:.3f}", "100"])),
    ("centum.csv", lambda l: wide(l, ["Time", *signal_names("", l.tag, ".PV", ".SV", ".MV"), l.tag + ".MODE"], lambda t: f"{t:%Y/%m/%d %H:%M:%S}", extra=["AUT"])),
    ("pcs7.csv", lambda l: wide(l, ["Zeitstempel", *signal_names("Anlage/Bereich2/", l.tag, "/PV_IN", "/SP", "/LMN")], lambda t: f"{t:%d.%m.%y %H:%M:%S}", ";", comma)),
    ("opcua.csv", lambda l: wide(l, ["SourceTimestamp", *signal_names("ns=2;s=Line3.", l.tag)], iso)),
    ("seconds.csv", lambda l: wide(l, ["time_s", *signal_names("", l.tag)], lambda t: f"{(t - START).total_seconds():.1f}")),
    ("rockwell.csv", lambda l: wide(l, ["Date", *signal_names("::[PLC01]Program:Main.", l.tag, ".PV", ".SP", ".CV")], lambda t: f"{t:%m/%d/%Y %H:%M:%S}")),
    ("thousands.csv", thousands),
    ("java_dates.csv", lambda l: wide(l, ["Date", *signal_names("", l.tag), "Quality"],
                                      lambda t: f"{DAYS[t.weekday()]} {MONTHS[t.month - 1]} {t.day:02} {t:%H:%M:%S} UTC {t.year}", extra=["Good"])),
]


def read_plant(folder, most, hours):
    """Returns the first `most` loops of the wide files that the study writes."""
    loops = []
    for path in sorted(pathlib.Path(folder).glob("*.csv")):
        with open(path, encoding="utf-8") as file:
            head, *rows = list(csv.reader(file))
        times = [datetime.datetime.fromisoformat(row[0].replace("Z", "+00:00")) for row in rows[:2]]
        period_s = (times[1] - times[0]).total_seconds()
        rows = rows[:int(hours * 3600 / period_s)]
        for k in range(1, len(head), 3):
            pv, co, sp = ([float(row[k + c]) for row in rows] for c in range(3))
            loops.append(Loop(head[k].rsplit(".", 1)[0], period_s, pv, co, sp))
    return loops[:most]


def write_layouts(loops, out):
    """Writes one file per layout and returns (file, tag)."""
    out = pathlib.Path(out)
    out.mkdir(parents=True, exist_ok=True)
    written = []
    for loop, (name, content) in zip(loops, LAYOUTS):
        made = content(loop)
        (out / name).write_bytes(made if isinstance(made, bytes) else made.encode())
        written.append((name, loop.tag))
    return written


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    loops = read_plant(sys.argv[1], len(LAYOUTS), 12.0)
    if len(loops) < len(LAYOUTS):
        sys.exit(f"{sys.argv[1]}: {len(loops)} loops, {len(LAYOUTS)} are needed")
    written = write_layouts(loops, sys.argv[2])
    with open(sys.argv[2] + ".tags.csv", "w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([("file", "tag"), *written])


if __name__ == "__main__":
    main()
