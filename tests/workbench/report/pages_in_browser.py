#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Tests the pages of loopwarden in a real browser (Debian's chromium, headless), from file://.

Usage: tests/workbench/report/pages_in_browser.py [--all] [--keep DIR]
Without --all: the report of gap. It opens without an error on the console, and zooms by button, mouse and key for all
plots at once. It shows values under the cursor, has its tables, prints, and fits 390 pixels.
--all adds every other page, light and dark, and the report of examples/gap-example.
--keep: folder for screenshots and PDFs. Exit code 1: a check failed. 74: no program or browser.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/support"))
from chromium import Chromium, WebDriverException  # noqa: E402
from selenium.webdriver.common.action_chains import ActionChains  # noqa: E402

BIN = pathlib.Path(os.environ.get("LOOPWARDEN_BIN_DIR", ROOT / "build/release/bin"))
MODELS = ROOT / "examples/models"
NARROW = 390


def loopwarden(*words, codes=(0,)):
    done = subprocess.run([BIN / "loopwarden", *map(str, words)], check=False, stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL)
    if done.returncode not in codes:
        sys.exit(f"loopwarden {' '.join(map(str, words))}: exit code {done.returncode}")


class Browser(Chromium):
    def show(self, page, width=1200, scheme="light"):
        self.screen(width, scheme=scheme)
        self.driver.get(page.as_uri())

    def fits(self, page):
        wide = self.run("document.documentElement.scrollWidth")
        self.check(wide <= NARROW, f"{page}: {wide} pixels wide on a screen of {NARROW}")

    def prints(self, page, keep):
        pdf = self.pdf()
        self.check(pdf.startswith(b"%PDF") and len(pdf) > 10000, f"{page}: does not print")
        if keep:
            (keep / f"{page}.pdf").write_bytes(pdf)

    def keep(self, name, keep):
        if keep:
            self.shot(keep / f"{name}.png", full=True)


def spans(text):
    low, high = text.removesuffix(" s").split(" to ")
    return float(low), float(high)


def try_gap_report(browser, page, keep):
    name = page.parent.name
    browser.show(page)
    span = browser.find("#span")
    browser.until(lambda: " to " in span.text, f"{name}: no span of time is shown")
    browser.check(browser.run("document.querySelectorAll('.uplot canvas').length") >= 4, f"{name}: fewer than four plots")
    drawn = browser.run("""[...document.querySelectorAll('.uplot canvas')].map((c) => {
      const p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
      let n = 0;
      for (let i = 3; i < p.length; i += 4) if (p[i]) ++n;
      return n;
    })""")
    browser.check(min(drawn, default=0) > 500, f"{name}: an empty plot")
    browser.keep(f"{name}-wide", keep)
    whole = spans(span.text)

    def zooms(act, what):
        before = spans(span.text)
        act()
        if browser.until(lambda: spans(span.text) != before, f"{name}: {what} does not zoom") is not None:
            low, high = spans(span.text)
            browser.check(high - low < before[1] - before[0], f"{name}: {what} does not show less")

    zooms(browser.find("button[data-act=closer]").click, "the button +")
    over = browser.find("#residual .u-over")
    browser.run("arguments[0].scrollIntoView({block: 'center'})", over)
    width = over.size["width"]
    zooms(lambda: ActionChains(browser.driver).move_to_element_with_offset(over, -int(width * 0.3), 0).click_and_hold()
          .move_by_offset(int(width * 0.3), 0).release().perform(), "drawing over a plot")
    zooms(lambda: browser.find("#residual .uplot").send_keys("+"), "the key +")
    browser.keep(f"{name}-zoomed", keep)
    browser.run("(() => { window.saved = []; const make = URL.createObjectURL;"
                "URL.createObjectURL = (blob) => { window.saved.push(blob); return make.call(URL, blob); }; })()")
    browser.find("button[data-act=csv]").click()
    browser.find("button[data-act=png]").click()
    saved = lambda: browser.run("window.saved.map((blob) => [blob.type, blob.size > 2000])")
    browser.until(lambda: saved() == [["text/csv", True], ["image/png", True]],
                  f"{name}: what is shown is not saved as a table and a picture: {saved()}")
    # The cursor of one plot reads all of them, with units.
    ActionChains(browser.driver).move_to_element(over).perform()
    values = lambda: [e.text for e in browser.all(".u-series .u-value")]
    browser.until(lambda: any(v.endswith("PV units") for v in values()) and any(v.endswith("CO units") for v in values()),
                  f"{name}: no values with units under the cursor: {values()}")
    browser.find("#residual .uplot").send_keys("0")
    browser.until(lambda: spans(span.text) == whole, f"{name}: the key 0 does not show all")
    zooms(lambda: browser.run("""[...document.querySelectorAll('a[data-from]')].reduce(
      (a, b) => (b.dataset.to - b.dataset.from < a.dataset.to - a.dataset.from ? b : a)).click()"""),
          "the link to the shortest located moment")
    browser.find("button[data-act=all]").click()
    # Checks its tables.
    for table in ("#trend details table", "#residual details table", "#output details table"):
        rows = len(browser.all(table + " tbody tr"))
        browser.check(rows >= 10, f"{name}: {table} has {rows} rows")
    # On paper the pictures are shown, with any zoom.
    browser.media("print", "light")
    shown = lambda selector: browser.run(f"getComputedStyle(document.querySelector('{selector}')).display")
    browser.check(shown("#trend .still") == "block" and shown("#trend .chart") == "none", f"{name}: paper gets no picture")
    browser.check(shown(".tools") == "none", f"{name}: buttons on paper")
    browser.keep(f"{name}-paper", keep)
    browser.media("", "light")
    browser.prints(name, keep)
    browser.show(page, NARROW)
    browser.until(lambda: " to " in browser.find("#span").text, f"{name}: no span of time on a narrow screen")
    browser.fits(name)
    browser.keep(f"{name}-narrow", keep)
    browser.show(page, scheme="dark")
    browser.keep(f"{name}-dark", keep)
    browser.quiet(name)


def try_plain_page(browser, page, name, keep):
    for scheme in ("light", "dark"):
        browser.show(page, scheme=scheme)
        browser.check(browser.run("document.querySelectorAll('svg').length") >= 1, f"{name}: no picture")
        browser.keep(f"{name}-{scheme}", keep)
    browser.prints(name, keep)
    browser.show(page, NARROW)
    browser.fits(name)
    browser.keep(f"{name}-narrow", keep)
    browser.quiet(name)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--all", action="store_true", help="every page")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for screenshots and PDFs")
    options = parser.parse_args()
    if not (BIN / "loopwarden").exists():
        print(f"pages_in_browser: no {BIN}/loopwarden: build the release preset first", file=sys.stderr)
        return 74
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    wrong = []
    with tempfile.TemporaryDirectory() as name:
        work = pathlib.Path(name)
        record = work / "record.csv"
        sticky = work / "sticky.yaml"  # the packing is tight from the start, and the set point moves
        sticky.write_text((MODELS / "plant1.yaml").read_text(encoding="utf-8")
                          .replace("from: 120, ramp: 180", "from: 0, ramp: 1")
                          .replace("[[0, 4], [30, 5]]", "[[0, 4], [20, 5.5], [90, 4.2], [160, 6]]"), encoding="utf-8")
        loopwarden("simulate", sticky, "--duration", 240, "--out", record)
        loopwarden("gap", record, "--model", MODELS / "plant1-believed.yaml", "--out", work / "gap")
        pages = []
        if options.all:
            example = ROOT / "examples/gap-example"
            loopwarden("gap", example / "record.csv", "--model", example / "model.yaml", "--out", work / "gap-example")
            loopwarden("tune", MODELS / "plant1.yaml", "--out", work / "tune.html")
            loopwarden("valve-test", MODELS / "plant1.yaml", "--out", work / "valve-test")
            loopwarden("compare", MODELS / "plant1.yaml", "--out", work / "compare")
            loopwarden("diagnose", ROOT / "examples/routine/r22.csv", "--report", work / "diagnose.html")
            loopwarden("train", MODELS / "plant1-believed.yaml", "--windows", 1400, "--restarts", 1, "--sizes", 3, "--epochs",
                       3, "--seed", 7, "--out", work / "train")
            routine = ROOT / "examples/routine"
            loopwarden("receipt", "--before", routine / "r22.csv", "--after", routine / "r01.csv", "--out", work / "receipt.html")
            survey = work / "survey"
            exports = work / "exports"
            shutil.copytree(routine, exports)
            # Names without a place to break, of a loop and of a skipped file.
            shutil.copy(routine / "r22.csv", exports / "historian_export_of_unit_two_week_48_fic_205.csv")
            (exports / "historian_export_of_the_whole_plant_without_values.csv").write_text("time,temperature\n0,1\n", encoding="utf-8")
            loopwarden("survey", exports, "--out", survey, codes=(0, 65))  # 65: a file was skipped
            loopwarden("survey", "--out", survey, "--against", survey)
            pages = [("tune", work / "tune.html"), ("valve-test", work / "valve-test/report.html"),
                     ("compare", work / "compare/report.html"), ("diagnose", work / "diagnose.html"), ("receipt", work / "receipt.html"),
                     ("survey", survey / "survey.html"), ("changes", survey / "changes.html"),
                     *(("train", page) for page in sorted((work / "train").rglob("*.html")))]
        try:
            with Browser(work / "profile", wrong) as browser:
                try_gap_report(browser, work / "gap/report.html", options.keep)
                if options.all:
                    try_gap_report(browser, work / "gap-example/report.html", options.keep)
                for name, page in pages:
                    try_plain_page(browser, page, name, options.keep)
        except WebDriverException as error:
            print(f"pages_in_browser: {error.msg}", file=sys.stderr)
            return 74
    print(f"{len(wrong)} wrong" if wrong else "all right")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
