# SPDX-License-Identifier: Apache-2.0
"""Tests many tabs of one browser, at the usual limits of page.yaml: content in each, live values in
each, quick reloads, and the end of the session in all of them."""
import tempfile
import time

from box import Box, Browser

TABS = 8
RELOADS = 10


def content(browser, where, begin):
    """Waits for the view and for live values."""
    shown = "document.querySelector('main h1') && [...document.querySelectorAll('.link')].some((one) => !one.hidden && one.textContent.includes('Live'))"
    browser.until(lambda: browser.run(shown), f"{where}: no content", 30)
    print(f"{where}: {time.monotonic() - begin:.1f} s")


def streams(browser):
    return browser.run_async("return (await (await fetch('/api/system')).json()).page.streams;")


def tried(wrong):
    box = Box(healthy=2, sticking=False)
    box.config.write_text(box.config.read_text(encoding="utf-8").replace("rate: 1000\n", ""), encoding="utf-8")
    with tempfile.TemporaryDirectory() as profile, box, Browser(profile, wrong) as browser:
        browser.driver.set_page_load_timeout(30)
        browser.log_in(box, "vera")
        for tab in range(TABS):
            if tab:
                browser.driver.switch_to.new_window("tab")
            begin = time.monotonic()
            browser.driver.get(f"{box.url}/#/alarms")
            content(browser, f"tab {tab + 1}", begin)
        for n in range(RELOADS):
            begin = time.monotonic()
            browser.driver.refresh()
            content(browser, f"reload {n + 1}", begin)
        browser.check(streams(browser) == 1, f"{TABS} tabs have {streams(browser)} event streams")
        tabs = browser.driver.window_handles
        browser.driver.switch_to.window(tabs[0])
        browser.log_out()
        for tab in tabs[1:]:
            browser.driver.switch_to.window(tab)
            browser.until(lambda: browser.all("form.panel input[name=password]"), "another tab keeps its data after the log-out")
        browser.log_in(box, "otto")
        browser.until(lambda: streams(browser) == 1, "no stream after a new log-in")
        browser.quiet("many tabs", allowed=("status of 401",))
