# SPDX-License-Identifier: Apache-2.0
"""Tests reports requested on a loop's page by an engineer and seen by all users."""
import re
import time

POST = """const {csrf} = await (await fetch('/api/session')).json();
  return (await fetch(a, {method: 'POST', body: JSON.stringify(b), headers: {'Content-Type': 'application/json', 'X-CSRF-Token': csrf}})).status;"""
ROWS = ".asked-reports tbody tr"


def form_comes(box, browser, tag):
    browser.go(box, f"loop/{tag}")
    browser.until(lambda: browser.all(".asked-reports form") and all(one.get_attribute("value") for one in browser.all(".asked-reports input")),
                  "the times are not those of the trend")


def move(box, tag):
    """Makes steps of SP, each held until PV has settled, to identify a model."""
    accelerate = box.ask({"request": "describe"})["accelerate"]
    begin = box.ask({"request": "loop", "loop": tag})["sp"]
    for by in (1, -1, 1, -1, 0):
        box.ask({"request": "set", "loop": tag, "set_point": begin + by})
        time.sleep(60 / accelerate)
    time.sleep(6)  # the recorder writes every 5 s


def ends(box, browser, tag, kind, how):
    """Returns its row when the row shows `how`."""
    browser.find(f".asked-reports select option[value={kind}]").click()
    browser.find(".asked-reports button[type=submit]").click()
    browser.until(lambda: browser.all(ROWS), f"{kind} is not in the list: {browser.text('.asked-reports')}")
    browser.until(lambda: re.search("\\b(done|failed)\\b", browser.text(ROWS)), f"{kind} does not end", 900)
    browser.check(how in browser.text(ROWS), f"{kind} ends so: {browser.text(ROWS)}")
    browser.until(lambda: "in the queue" not in browser.text(".asked-reports form"), f"{kind} has ended, but is shown as waiting")
    browser.until(lambda: browser.all(f"{ROWS} th a"), f"{kind} can't be opened: {browser.text(ROWS)}", 30)
    return browser.find(f"{ROWS} th a").get_attribute("href")


def opens(browser, link, words):
    """Opens the report in a separate tab, as a reader does."""
    mine = browser.driver.current_window_handle
    browser.driver.switch_to.new_window("tab")
    browser.driver.get(link)
    for word in words:
        browser.until(lambda: word in browser.text("body"), f"{link} does not say {word!r}: {browser.text('body')[:200]}")
    browser.check("http" in browser.driver.current_url, f"{link} leads to {browser.driver.current_url}")
    browser.driver.close()
    browser.driver.switch_to.window(mine)


def made_of_the_record(box, browser, tag, still):
    """Makes a gap report of `tag`, whose SP moves, and a commissioning of `still`, whose SP does
    not. The latter reports the missing data."""
    move(box, tag)
    form_comes(box, browser, tag)
    link = ends(box, browser, tag, "gap", "done")
    opens(browser, link, ["Gap"])
    form_comes(box, browser, still)
    link = ends(box, browser, still, "commission", "not enough movement")
    opens(browser, link, ["not enough movement"])


def asked(box, browser, tag):
    """An operator is not offered a report, and a request is refused. An engineer's report covers
    the time of the trend and opens in its sandbox."""
    path = f"/api/loops/{tag}/reports"
    browser.go(box, f"loop/{tag}")
    browser.until(lambda: "log in as an engineer" in browser.text(".asked-reports"), "an operator does not see who may request reports")
    browser.check(not browser.all(".asked-reports form"), "an operator is offered to ask for a report")
    status = browser.run_async(POST, path, {"kind": "gap", "from_ms": 1, "to_ms": 2})
    browser.check(status == 403, f"an operator's wish for a report gets {status}")

    browser.log_out()
    browser.log_in(box, "ella")
    form_comes(box, browser, tag)
    status = browser.run_async(POST, path, {"kind": "gap", "from_ms": 1, "to_ms": 60_001})
    browser.check(status == 409, f"a report of before the record gets {status}")
    browser.find(".asked-reports select option[value=diagnose]").click()
    browser.check("without a model" in browser.text(".asked-reports form"), "a kind does not say what it is")
    browser.find(".asked-reports button[type=submit]").click()
    browser.until(lambda: browser.all(ROWS), f"the report is not in the list: {browser.text('.asked-reports')}")
    browser.until(lambda: browser.all(f"{ROWS} th a"), f"the report is not made: {browser.text('.asked-reports')}", 300)
    browser.check("ella" in browser.text(ROWS), "the list does not say who asked")
    link = browser.find(f"{ROWS} th a").get_attribute("href")
    policy = browser.run_async("const r = await fetch(a); return [r.status, r.headers.get('Content-Security-Policy')];", link)
    browser.check(policy[0] == 200 and policy[1].startswith("sandbox"), f"the report has no sandbox: {policy}")
