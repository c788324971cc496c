# SPDX-License-Identifier: Apache-2.0
"""Tests the text of each view without valid data: logged out, in its first seconds, with old values,
and without data. An unknown state is never shown as good."""
import signal
import tempfile

from box import Box, Browser

# Each as a visible text that is not struck out and does not begin with "unknown".
GOOD = r"(?<!its )\bnormal\b|No (active|unacknowledged)|\bLive\b|OK\. No warnings|\bAUTO\b|writes its output|yes|\bgood\b"
TAG = "FIC-101"
VIEWS = ["", f"loop/{TAG}", "alarms", f"alarms/{TAG}/incident", f"alarms/{TAG}/stiction", f"trends?curves={TAG}:pv", "journal", "reports", "system"]
# Texts of a healthy box in views without content.
NOTHING = {"trends": "Up to eight curves", "alarms": "No active or unacknowledged alarms", "alarms/FIC-102/stiction": "No evidence is stored", "journal": "No matching entries",
           "reports": "The state directory has no reports", "loop/FIC-102?from=1000000000000&to=1000000600000": "No records in this span", "system": "No changes in the journal"}
# Answers never arrive, except the one about the session.
HOLD = """(() => {
  const ask = window.fetch;
  window.fetch = (path, options) => (path === '/api/session' ? ask(path, options) : new Promise(() => {}));
  window.SharedWorker = undefined; // the stream is opened by the page
  window.EventSource = class extends EventTarget { static CLOSED = 2; readyState = 0; close() {} };
})()"""


def claims(browser):
    """Returns the texts on the screen that show a good state."""
    return browser.run("""((pattern) => {
      const good = new RegExp(pattern), walker = document.createTreeWalker(document.querySelector('#app'), NodeFilter.SHOW_TEXT), found = [];
      for (let node = walker.nextNode(); node; node = walker.nextNode()) {
        const text = node.textContent.trim(), seen = node.parentElement.checkVisibility();
        if (!seen || !good.test(text) || /^unknown/i.test(text) || node.parentElement.closest('select, details:not(.folding), caption, .theme, .guide, .history, .unseen, .journal')) continue;
        let struck = false;
        for (let e = node.parentElement; e; e = e.parentElement) struck ||= getComputedStyle(e).textDecorationLine === 'line-through';
        if (!struck) found.push(text.slice(0, 60));
      }
      return found;
    })(arguments[0])""", GOOD)


def logged_out(box, browser):
    for route in VIEWS:
        browser.driver.get(f"{box.url}/#/{route}")
        browser.driver.refresh()
        browser.until(lambda: browser.all("form.panel input[name=password]"), f"{route}: no log-in is requested")
        browser.check(not claims(browser), f"{route}, logged out: {claims(browser)}")
        browser.check(TAG not in browser.text("body"), f"{route}: who is not logged in reads of {TAG}")


def first_seconds(box, browser):
    script = browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": HOLD})["identifier"]
    for route in VIEWS:
        browser.driver.get(f"{box.url}/#/{route}")
        browser.driver.refresh()
        browser.until(lambda: "Loading" in browser.text("main"), f"{route}: does not say that it loads: {browser.text('main')[:200]}")
        browser.check(not claims(browser), f"{route}, in its first seconds: {claims(browser)}")
    browser.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", {"identifier": script})
    browser.driver.get(box.url)
    browser.driver.refresh()


def no_answer(box, browser):
    """An empty page looks broken: it shows that it waits, even for the session."""
    script = browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": "window.fetch = () => new Promise(() => {});"})["identifier"]
    browser.driver.get(box.url)
    browser.driver.refresh()
    browser.until(lambda: "Loading" in browser.text("main"), f"a page without an answer shows {browser.text('main')!r}")
    browser.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", {"identifier": script})
    browser.driver.refresh()
    browser.until(lambda: browser.all(".tile") and "Loading" not in browser.text("main"), "the notice stays")


def stale(box, browser):
    is_stale = lambda: browser.run("document.body.classList.contains('stale')")
    for route in VIEWS:
        browser.go(box, route)
        browser.until(lambda: browser.text("main").strip() and "Loading" not in browser.text("main") and not is_stale(), f"{route}: stays empty")
        box.daemon.send_signal(signal.SIGSTOP)
        try:
            browser.until(is_stale, f"{route}: values of a stopped daemon look fresh")
            browser.until(lambda: not claims(browser), f"{route}, stale: {claims(browser)}")
            browser.check(browser.run("document.title").startswith("No values"), f"{route}: the tab shows {browser.run('document.title')!r}")
        finally:
            box.daemon.send_signal(signal.SIGCONT)
        browser.until(lambda: not is_stale(), f"{route}: values don't come back")


def never_heard_of(box, browser):
    """Tests a page that started before its daemon."""
    box.kill_daemon()
    box.page.kill()
    box.page.wait()
    box.start_page()
    browser.until(lambda: browser.all("form.panel input[name=password]"), "after a restart of the page no log-in is requested")
    browser.log_in(box, "vera")
    for route in VIEWS:
        browser.driver.get(f"{box.url}/#/{route}")
        browser.driver.refresh()
        browser.until(lambda: browser.run("document.body.classList.contains('stale')"), f"{route}: a daemon that never answered is not reported")
        browser.check(not claims(browser), f"{route}, without a daemon: {claims(browser)}")
        browser.check("no loops" not in browser.text("main"), f"{route}: unknown loops are shown as none")
    box.start_daemon()
    browser.until(lambda: not browser.run("document.body.classList.contains('stale')"), "the daemon that has come is not seen")


def opened(browser):
    browser.until(lambda: browser.all(".alarm-figures"), "no figures of the alarms")
    browser.run("(() => { document.querySelector('.alarm-figures').open = true; })()")


def figures_of_alarms(box, browser):
    """Tests folded parts separately: loading, then old."""
    script = browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": HOLD})["identifier"]
    browser.driver.get(f"{box.url}/#/alarms")
    browser.driver.refresh()
    opened(browser)
    browser.until(lambda: "Loading" in browser.text(".alarm-figures"), "figures that are on their way don't say so")
    browser.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", {"identifier": script})
    browser.driver.get(f"{box.url}/#/alarms")
    browser.driver.refresh()
    opened(browser)
    browser.until(lambda: "Alarms per hour" in browser.text(".alarm-figures"), "no figures")
    box.daemon.send_signal(signal.SIGSTOP)
    try:
        browser.until(lambda: "Unknown" in browser.text(".alarm-figures") and "within target" not in browser.text(".alarm-figures"), f"the figures of a stopped daemon are {browser.text('.alarm-figures')!r}")
    finally:
        box.daemon.send_signal(signal.SIGCONT)
    browser.until(lambda: "Alarms per hour" in browser.text(".alarm-figures"), "figures don't come back")


def no_data(wrong):
    with tempfile.TemporaryDirectory() as profile, Box(healthy=2, accelerate=1, sticking=False, recording=False) as box, Browser(profile, wrong) as browser:
        browser.screen()
        browser.log_in(box, "vera")
        for route, words in NOTHING.items():
            browser.go(box, route)
            browser.until(lambda: words in browser.text("main"), f"{route}: does not say {words!r}: {browser.text('main')[:300]}")
        browser.go(box, "alarms")
        opened(browser)
        browser.until(lambda: "No alarms in this time" in browser.text(".alarm-figures"), "the absence of alarms is not shown")

