#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The pages of loopwarden in a real browser: Debian's chromium, headless, from file://.

Usage: tests/workbench/report/pages_in_browser.py [--all] [--keep DIR]
Without --all: the report of gap. It opens without an error on the console, zooms by button, mouse and key for all
plots at once, reads values off under the cursor, has its tables, prints, and fits 390 pixels. --all: every other page,
light and dark, and the report of data/gap-example. --keep: screenshots and PDFs go there. Exit code 1: something is
wrong; 74: no program, no browser.
"""
import argparse
import base64
import os
import pathlib
import subprocess
import sys
import tempfile

try:
    from selenium import webdriver
    from selenium.common.exceptions import WebDriverException
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.support.ui import WebDriverWait
except ImportError:
    sys.exit("pages_in_browser: python3-selenium is missing: tools/install-packages test")

ROOT = pathlib.Path(__file__).resolve().parents[3]
BIN = pathlib.Path(os.environ.get("LOOPWARDEN_BIN_DIR", ROOT / "build/release/bin"))
MODELS = ROOT / "config/examples/models"
NARROW = 390
wrong = []


def check(right, what):
    if not right:
        wrong.append(what)
        print(f"WRONG: {what}", file=sys.stderr)


def loopwarden(*words):
    subprocess.run([BIN / "loopwarden", *map(str, words)], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)


class Browser:
    def __init__(self, profile):
        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
                     f"--user-data-dir={profile}"):
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.driver.quit()

    def show(self, page, width=1200, scheme="light"):
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                    {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600})
        self.media("", scheme)
        self.driver.get(page.as_uri())

    def media(self, media, scheme="light"):
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {
            "media": media, "features": [{"name": "prefers-color-scheme", "value": scheme}]})

    def run(self, script, *arguments):
        return self.driver.execute_script("return " + script, *arguments)

    def find(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def until(self, condition, what):
        """Waits for what the page does in its next frames; the limit is for a page that never does."""
        try:
            WebDriverWait(self.driver, 30, 0.02).until(lambda _: condition())
            return True
        except WebDriverException:
            check(False, what)
            return False

    def quiet(self, page):
        for entry in self.driver.get_log("browser"):
            # The browser's own start page has something to say on a crowded machine.
            if not entry["message"].startswith("chrome://"):
                check(False, f"{page}: console: {entry['message']}")

    def fits(self, page):
        wide = self.run("document.documentElement.scrollWidth")
        check(wide <= NARROW, f"{page}: {wide} pixels wide on a screen of {NARROW}")

    def prints(self, page, keep):
        pdf = base64.b64decode(self.driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})["data"])
        check(pdf.startswith(b"%PDF") and len(pdf) > 10000, f"{page}: does not print")
        if keep:
            (keep / f"{page}.pdf").write_bytes(pdf)

    def keep(self, name, keep):
        if not keep:
            return
        size = self.driver.execute_cdp_cmd("Page.getLayoutMetrics", {})["cssContentSize"]
        shot = self.driver.execute_cdp_cmd("Page.captureScreenshot", {
            "captureBeyondViewport": True,
            "clip": {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}})
        (keep / f"{name}.png").write_bytes(base64.b64decode(shot["data"]))


def spans(text):
    low, high = text.removesuffix(" s").split(" to ")
    return float(low), float(high)


def try_gap_report(browser, page, keep):
    name = page.parent.name
    browser.show(page)
    span = browser.find("#span")
    browser.until(lambda: " to " in span.text, f"{name}: no span of time is shown")
    check(browser.run("document.querySelectorAll('.uplot canvas').length") >= 4, f"{name}: fewer than four plots")
    drawn = browser.run("""[...document.querySelectorAll('.uplot canvas')].map((c) => {
      const p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
      let n = 0;
      for (let i = 3; i < p.length; i += 4) if (p[i]) ++n;
      return n;
    })""")
    check(min(drawn, default=0) > 500, f"{name}: an empty plot")
    browser.keep(f"{name}-wide", keep)
    whole = spans(span.text)

    def zooms(act, what):
        before = spans(span.text)
        act()
        if browser.until(lambda: spans(span.text) != before, f"{name}: {what} does not zoom"):
            low, high = spans(span.text)
            check(high - low < before[1] - before[0], f"{name}: {what} does not show less")

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
    values = lambda: [e.text for e in browser.driver.find_elements(By.CSS_SELECTOR, ".u-series .u-value")]
    browser.until(lambda: any(v.endswith("PV units") for v in values()) and any(v.endswith("CO units") for v in values()),
                  f"{name}: no values with units under the cursor: {values()}")
    browser.find("#residual .uplot").send_keys("0")
    browser.until(lambda: spans(span.text) == whole, f"{name}: the key 0 does not show all")
    zooms(lambda: browser.run("""[...document.querySelectorAll('a[data-from]')].reduce(
      (a, b) => (b.dataset.to - b.dataset.from < a.dataset.to - a.dataset.from ? b : a)).click()"""),
          "the link to the shortest located moment")
    browser.find("button[data-act=all]").click()
    # Its tables.
    for table in ("#trend details table", "#residual details table", "#output details table"):
        rows = len(browser.driver.find_elements(By.CSS_SELECTOR, table + " tbody tr"))
        check(rows >= 10, f"{name}: {table} has {rows} rows")
    # On paper stand the pictures, whatever is zoomed.
    browser.media("print")
    shown = lambda selector: browser.run(f"getComputedStyle(document.querySelector('{selector}')).display")
    check(shown("#trend .still") == "block" and shown("#trend .chart") == "none", f"{name}: paper gets no picture")
    check(shown(".tools") == "none", f"{name}: buttons on paper")
    browser.keep(f"{name}-paper", keep)
    browser.media("")
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
        check(browser.run("document.querySelectorAll('svg').length") >= 1, f"{name}: no picture")
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
            example = ROOT / "data/gap-example"
            loopwarden("gap", example / "record.csv", "--model", example / "model.yaml", "--out", work / "gap-example")
            loopwarden("tune", MODELS / "plant1.yaml", "--out", work / "tune.html")
            loopwarden("valve-test", MODELS / "plant1.yaml", "--out", work / "valve-test")
            loopwarden("compare", MODELS / "plant1.yaml", "--out", work / "compare")
            loopwarden("diagnose", ROOT / "data/routine/r22.csv", "--report", work / "diagnose.html")
            loopwarden("train", MODELS / "plant1-believed.yaml", "--windows", 1400, "--restarts", 1, "--sizes", 3, "--epochs",
                       3, "--seed", 7, "--out", work / "train")
            survey = work / "survey"
            loopwarden("survey", ROOT / "data/routine", "--out", survey)
            loopwarden("survey", "--out", survey, "--against", survey)
            pages = [("tune", work / "tune.html"), ("valve-test", work / "valve-test/report.html"),
                     ("compare", work / "compare/report.html"), ("diagnose", work / "diagnose.html"),
                     ("survey", survey / "survey.html"), ("changes", survey / "changes.html"),
                     *(("train", page) for page in sorted((work / "train").rglob("*.html")))]
        try:
            with Browser(work / "profile") as browser:
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
