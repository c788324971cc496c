#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Tests the fleet's page in a real browser (Debian's chromium, headless), on a real PostgreSQL with a
plant of 40 boxes.

Usage: tests/services/page/browser/fleet_in_browser.py [--keep DIR]
Covers these parts:
- log-in on a machine without a daemon
- the worst valves: sorted, filtered, searched
- silent boxes, different versions, alarm rates
- a valve
- a database that stops and returns
- axe-core in both themes, 360 pixels, paper, hostile words
- the link to the fleet from a box
--keep: folder for screenshots. Exit code 1: a check failed. 74: no program, browser or database.
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from box import BIN, Browser, WebDriverException  # noqa: E402
from fleet_plant import HOSTILE, KINDS, LOOPS, SICK, FleetPlant  # noqa: E402
from page_in_browser import axe, axe_source, drawn, keep, wrong  # noqa: E402

WORST = SICK[0]
BOXES = 40


def texts(browser, selector):
    return [text.replace("\u00a0", " ").replace("\u2009", " ") for text in browser.run("[...document.querySelectorAll(arguments[0])].map((e) => e.innerText)", selector)]


def nav(browser):
    return browser.run("[...document.querySelectorAll('.nav a')].filter((a) => a.offsetParent).map((a) => a.innerText.trim())")


def boxes_of(rows):
    return [row.split("\n")[0].strip() for row in rows]


def only_the_fleet(plant, browser):
    """A machine without a daemon begins with the fleet, and has no link to a box."""
    browser.driver.get(plant.url)
    browser.until(lambda: browser.all("form.panel input[name=password]"), "no log-in is requested")
    browser.check(not browser.all("main table"), "the fleet is shown to whom is not logged in")
    browser.log_in(plant, "vera")
    browser.until(lambda: browser.run("document.querySelector('main').dataset.view") == "fleet" and browser.all(".worst tbody tr"), "the fleet is not the first view")
    browser.check(nav(browser) == ["Fleet"], f"the ways are {nav(browser)}")
    browser.check(browser.run("document.querySelector('.nav a[aria-current]').innerText.trim()") == "Fleet", "the fleet's way is not marked")
    browser.check(not browser.run("document.querySelector('.summary').offsetParent"), "alarms of a box are shown without a box")
    browser.check(not browser.run("document.body.classList.contains('stale')"), "values of a box that is not there are called old")


def worst_shows(browser):
    rows = texts(browser, ".worst tbody tr")
    browser.check(len(rows) == len(SICK), f"{len(rows)} sick valves")
    sizes = [float(size.split()[0]) for size in texts(browser, ".worst td.number")]
    browser.check(sizes == sorted(sizes, reverse=True) and sizes[0] == WORST[3], f"the worst are not first: {sizes}")
    browser.check(WORST[0] in rows[0] and "Stiction" in rows[0] and "acknowledged" in rows[0], f"the worst says {rows[0]!r}")
    browser.check("41 d" in rows[0], f"the worst is not ill for 41 days: {rows[0]!r}")
    high, low = browser.run("['high', 'low'].map((name) => document.querySelectorAll(`.worst .icon-${name}`).length)")
    # 5 % and more, and low air, require action now.
    browser.check((high, low) == (sum(s[3] >= 5 for s in SICK), sum(s[3] < 5 for s in SICK)), f"{high} squares, {low} triangles")
    curves = browser.run("[...document.querySelectorAll('.weeks-curve')].map((p) => p.getBBox()).map((b) => [b.width, b.y, b.height])")
    browser.check(len(curves) == len(SICK) and all(width > 50 for width, _, _ in curves), f"curves: {curves}")
    browser.check(min(y for _, y, _ in curves) == curves[0][1] < 2, "the worst's curve is not the highest")
    browser.check(curves[0][2] > 10, "a fault that grew has a level curve")
    spoken = browser.run("document.querySelector('.worst .curve-cell .unseen').textContent").replace("\u00a0", " ")
    browser.check(spoken.startswith("now 11.4 %, at most"), f"the curve is announced as {spoken!r}")
    figures = dict(zip(texts(browser, ".figure dt"), texts(browser, ".figure .value")))
    browser.check(figures["Edge boxes online"] == f"39 of {BOXES}" and figures["Sick valves"] == str(len(SICK)) and figures["Silent edge boxes"] == "2", f"figures: {figures}")
    browser.check(figures["Loops online"] == f"{LOOPS * (BOXES - 1)} of {LOOPS * BOXES}", f"figures: {figures}")
    browser.check(HOSTILE in browser.text(".worst") and not browser.all("main img"), "a tag became markup")


def worst_used(browser):
    """Tests order, group, search and keyboard."""
    boxes = lambda: [text.split("·")[1].strip() for text in texts(browser, ".worst tbody th small")]
    browser.press(".worst th:nth-child(4) button")
    browser.until(lambda: browser.find(".worst th:nth-child(4)").get_attribute("aria-sort") == "ascending", "a sorted column does not say so")
    browser.check(boxes()[0] == "crude-09", f"the longest ill is not first: {boxes()[0]}")
    browser.press(".worst th:nth-child(4) button")
    browser.until(lambda: boxes()[0] == "utilities-02", "the order does not turn")
    browser.press(".worst th:nth-child(3) button")
    browser.until(lambda: boxes()[0] == WORST[0], "sizes don't begin with the greatest")
    search = browser.find("main input[type=search]")
    search.send_keys("backlash CRUDE")
    browser.until(lambda: boxes() == ["crude-11", "crude-09"], f"the search shows {boxes()}")
    browser.check("2 shown of 12" in browser.text("main").replace("\u2009", ""), "it does not say how many are shown of how many")
    search.clear()
    search.send_keys("nothing like this")
    browser.until(lambda: "No matching rows" in browser.text("main") and not texts(browser, ".worst tbody tr:not([hidden])")[:0], "a search without matches shows no message")
    browser.run("(() => { const s = document.querySelector('main input[type=search]'); s.value = ''; s.dispatchEvent(new Event('input')); })()")
    browser.run("(() => { const s = document.querySelector('main select'); s.value = 'Utilities'; s.dispatchEvent(new Event('change')); })()")
    browser.until(lambda: boxes() == ["utilities-02", "utilities-06", "utilities-09"], f"the group shows {boxes()}")
    browser.until(lambda: dict(zip(texts(browser, ".figure dt"), texts(browser, ".figure .value")))["Edge boxes online"] == "10 of 10", "figures are of another group")
    browser.check(boxes_of(texts(browser, ".pair-of-panels section:nth-child(1) tbody tr")) == ["utilities-04"], "silent boxes of another group")
    browser.run("(() => { const s = document.querySelector('main select'); s.value = ''; s.dispatchEvent(new Event('change')); })()")
    browser.until(lambda: len(boxes()) == len(SICK), "the group stays")
    # The next answer must not move the reader's position.
    browser.run("document.querySelector('.worst tbody tr:nth-child(3) a').focus()")
    before = browser.text(".as-of")
    browser.until(lambda: browser.text(".as-of") != before, "nothing is asked again")
    browser.check(browser.run("document.activeElement === document.querySelector('.worst tbody tr:nth-child(3) a')"), "the focus is lost with the next answer")


def others_show(browser):
    silent = texts(browser, ".pair-of-panels section:nth-child(1) tbody tr")
    browser.check(boxes_of(silent) == ["crude-07", "utilities-04"], f"silent: {silent}")
    browser.check("away" in silent[0] and "3 h" in silent[0] and "connected, silent" in silent[1] and "min" in silent[1], f"silent: {silent}")
    browser.check("clock is ahead by 1 min 14 s" in silent[0] and "used twice" in silent[1] and "clock" not in silent[1], f"notes: {silent}")
    versions = browser.run("[...document.querySelectorAll('.pair-of-panels section:nth-child(2) tbody tr')].map((r) => [r.cells[0].innerText.split('\\n')[0].trim(), ...[...r.cells].slice(1, 4).map((c) => c.querySelector('.icon-low') !== null), r.cells[4].innerText !== ''])")
    browser.check(versions == [["crude-02", True, False, False, False], ["crude-12", False, False, False, True], ["reformer-03", False, False, False, True],
                               ["reformer-06", False, False, True, False], ["reformer-13", True, False, False, False], ["utilities-05", False, True, False, True]], f"versions: {versions}")
    rates = {row.split("\t")[0].split("\n")[0]: row for row in texts(browser, ".fleet-body > section:has(.rate) tbody tr")}
    browser.check(list(rates) == ["All groups", "Crude", "Reformer", "Utilities"], f"groups: {list(rates)}")
    browser.check("floods" in rates["Reformer"] and "acceptable" in rates["Utilities"], f"rates: {rates}")
    flood, bars = browser.run("['.rate-flood', '.rate-bar'].map((c) => (document.querySelectorAll(c)[2].getAttribute('d').match(/M/g) ?? []).length)")
    browser.check(8 <= flood <= 12 and bars > 60, f"{flood} bars in floods, {bars} others")


def valve_shows(plant, browser, source, folder):
    browser.press(".worst tbody tr:first-child a")
    browser.until(lambda: browser.run("document.querySelector('main').dataset.view") == "valve" and browser.all("main h1"), "the valve does not open")
    browser.until(lambda: drawn(browser, ".panes canvas", "measured") > 150, "its weeks are not drawn")
    browser.until(lambda: drawn(browser, ".panes canvas", "high") > 200, "its alarm is no band")
    text = browser.text("main")
    for words in ("Stiction", "acknowledged", "CO travels 11.2 %", "Loosen or renew", "crude-03", "Control performance", "record.csv", "0.9 %"):
        browser.check(words in text, f"the valve does not say {words!r}")
    browser.check(browser.run("document.querySelector('.nav a[aria-current]').innerText.trim()") == "Fleet", "the fleet's way is not marked on a valve")
    span = lambda: browser.text(".cursor-time")
    browser.run("document.querySelector('.plot').focus()")
    before = span()
    browser.driver.switch_to.active_element.send_keys("\ue012")  # left
    browser.until(lambda: span() != before, "an arrow does not move the cursor")
    axe(browser, "valve", source)
    keep(browser, folder, "valve", full=True)
    browser.press(".back-to a")
    browser.until(lambda: browser.all(".worst tbody tr"), "no way back")
    browser.press(f".worst a[href*='{SICK[1][0]}']")
    browser.until(lambda: browser.text("main h1") == HOSTILE, f"the valve of a hostile name is {browser.text('main h1')!r}")
    browser.check(not browser.all("main img"), "a tag became markup")
    browser.go(plant, "valve/Crude/crude-03/none")
    browser.until(lambda: "there is no such valve" in browser.text("main"), "a missing valve is not reported")


def away_is_not_known(plant, browser):
    """A valve of a box that is away shows its last values struck out, and is not shown as
    healthy."""
    browser.go(plant, f"valve/Crude/crude-07/{KINDS[50 % len(KINDS)]}-0701")
    browser.until(lambda: "not been heard since" in browser.text(".old-note"), f"the absence of the box is not shown: {browser.text('main')[:200]}")
    struck = browser.run("getComputedStyle(document.querySelector('.last-values .value')).textDecorationLine")
    browser.check("line-through" in struck and not browser.run("document.querySelector('main .icon-ok')"), "a valve of a box that is away looks well")
    browser.go(plant, "fleet")
    browser.until(lambda: browser.all(".worst tbody tr"), "no way back to the fleet")
    browser.check("Edge boxes that report" in browser.text("main"), "loops of silent boxes are shown as good")


def database_stops(plant, browser):
    browser.go(plant, "fleet")
    browser.until(lambda: browser.all(".worst tbody tr"), "no rows")
    browser.check(not browser.run("document.querySelector('.old-note').offsetParent"), "fresh rows are called old")
    plant.stop_database()
    browser.until(lambda: "does not answer" in browser.text(".old-note"), "the absence of the database is not shown")
    shown = lambda: (len(browser.all(".worst tbody tr")), browser.run("document.querySelector('.fleet-body').hasAttribute('data-old')"),
                     browser.run("getComputedStyle(document.querySelector('.worst td .value')).textDecorationLine"))
    browser.check(shown() == (len(SICK), True, "line-through"), f"what is old is shown as {shown()}")
    age = browser.text(".old-note")
    browser.until(lambda: browser.text(".old-note") != age, "the age stands still")
    browser.driver.refresh()
    browser.until(lambda: shown() == (len(SICK), True, "line-through"), "a page opened while the database is away is empty")
    plant.start_database()
    browser.until(lambda: not browser.run("document.querySelector('.old-note').offsetParent") and shown()[1] is False, "a database that is back is not seen", 120)


def narrow_and_paper(plant, browser, source, folder):
    valve = "valve/" + browser.run("document.querySelector('.worst a').getAttribute('href').slice('#/valve/'.length)")
    for width, scheme in ((360, "dark"), (768, "light"), (3840, "dark")):
        browser.screen(width, 2160 if width > 1000 else 760, scheme)
        for route in ("fleet", valve):
            browser.go(plant, route)
            name = f"{width}-{route.split('/')[0]}"
            browser.until(lambda: browser.all("main table") and "Loading" not in browser.text("main"), f"{name} stays empty")
            wide = browser.run("document.documentElement.scrollWidth")
            browser.check(wide <= width, f"{name}: {wide} pixels wide on a screen of {width}")
            keep(browser, folder, name, full=True)
            if width == 360:
                cut = browser.run("[...document.querySelectorAll('main .scroller')].filter((e) => e.scrollWidth > e.clientWidth + 1).map((e) => e.getAttribute('aria-label'))")
                browser.check(not cut, f"{name}: tables that are cut off: {cut}")
                small = browser.run("""[...document.querySelectorAll('.nav a, main button, main select, main input')].filter((e) => e.offsetParent && !e.closest('table'))
                  .map((e) => [e.textContent.slice(0, 20), Math.round(e.getBoundingClientRect().height)]).filter(([, h]) => h < 32)""")
                browser.check(not small, f"{name}: too small for a finger: {small[:4]}")
    for scheme in ("dark", "light"):
        browser.screen(scheme=scheme)
        browser.go(plant, "fleet")
        browser.until(lambda: browser.all(".worst tbody tr"), "no rows")
        axe(browser, f"fleet, {scheme}", source)
        keep(browser, folder, f"fleet-{scheme}", full=True)
    browser.media("print")
    browser.check(browser.run("[...document.querySelectorAll('.nav, .tools')].every((e) => getComputedStyle(e).display === 'none')"), "controls on paper")
    browser.check(browser.run("getComputedStyle(document.querySelector('.worst .sort')).display !== 'none'"), "a table on paper has no heads")
    pdf = browser.pdf()
    browser.check(pdf.startswith(b"%PDF") and len(pdf) > 8000, "the fleet does not print")
    browser.media("")


def beside_a_box(plant, browser):
    """A box's page with a fleet has links to both, also on a phone."""
    plant.start_page(box=True)
    browser.screen(360, 760)
    browser.driver.get(plant.url)
    browser.log_in(plant, "vera")
    browser.until(lambda: browser.run("document.querySelector('main').dataset.view") == "overview", "the box is not the first view")
    browser.check(nav(browser) == ["Overview", "Alarms", "Trends", "Journal", "Reports", "System", "Fleet"], f"the ways are {nav(browser)}")
    browser.until(lambda: "No values" in browser.text(".banner"), "a box without a daemon does not say so")
    wide = browser.run("document.documentElement.scrollWidth")
    browser.check(wide <= 360, f"six ways are {wide} pixels wide")
    browser.press(".nav a[href='#/fleet']")
    browser.until(lambda: len(browser.all(".worst tbody tr")) == len(SICK), "the fleet does not open together with a box")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", type=pathlib.Path, help="folder for screenshots")
    parser.add_argument("--port", type=int, default=0, help="of the page; any free one else")
    options = parser.parse_args()
    for program in ("loopwarden-page", "loopwarden-fleet"):
        if not os.access(BIN / program, os.X_OK):
            print(f"fleet_in_browser: no {BIN}/{program}: build the release preset first", file=sys.stderr)
            return 74
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    try:
        source = axe_source()
        with tempfile.TemporaryDirectory() as profile, FleetPlant(users=True, hostile=True, port=options.port) as plant, Browser(profile, wrong) as browser:
            browser.screen()
            only_the_fleet(plant, browser)
            worst_shows(browser)
            others_show(browser)
            worst_used(browser)
            valve_shows(plant, browser, source, options.keep)
            browser.go(plant, "fleet")
            browser.until(lambda: browser.all(".worst tbody tr"), "no rows")
            narrow_and_paper(plant, browser, source, options.keep)
            browser.quiet("fleet", allowed=("status of 401", "status of 404", "getImageData"))
            away_is_not_known(plant, browser)
            database_stops(plant, browser)
            browser.quiet("database away", allowed=("status of 503",))
            beside_a_box(plant, browser)
            browser.quiet("beside a box", allowed=("status of 401", "status of 503", "ERR_"))
    except (WebDriverException, OSError, subprocess.CalledProcessError) as error:
        print(f"fleet_in_browser: {error}", file=sys.stderr)
        return 74
    print(f"{len(wrong)} wrong" if wrong else "all right")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
