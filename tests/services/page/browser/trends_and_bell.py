# SPDX-License-Identifier: Apache-2.0
"""Tests several loops in one trend, kept in the address; notes on trend and incident; sound,
notification and the tab."""
from selenium.webdriver.common.keys import Keys

TAG = "FIC-101"
CURVES = f"trends?curves={TAG}:pv,FIC-102:pv,FIC-102:co"
# Counts sounds and notifications in place of a loudspeaker and a desktop.
LISTEN = """(() => {
  window.heard = {tones: 0, notes: []};
  const start = OscillatorNode.prototype.start;
  OscillatorNode.prototype.start = function (...when) { ++window.heard.tones; return start.apply(this, when); };
  window.Notification = class { static permission = 'granted'; constructor(title) { window.heard.notes.push(title); } };
})()"""


def rows(browser):
    return int(browser.find(".panes").get_attribute("data-rows") or 0)


def several_loops(box, browser):
    browser.go(box, CURVES)
    browser.until(lambda: rows(browser) > 200, "no rows of several loops")
    browser.check(len(browser.all(".pane")) == 2, "curves of one unit don't share a pane")
    browser.check(len(browser.all(".chosen-curves li")) == 3, "not all curves of the address are there")
    browser.until(lambda: browser.text(".curve:nth-child(2) .value").endswith("L/min"), "the second loop's value has no unit")
    browser.find(".adder input").send_keys("FIC-104", Keys.ENTER)
    browser.until(lambda: "FIC-104:pv" in browser.run("decodeURIComponent(location.hash)"), "a curve that was added is not in the address")
    browser.find(".adder input").clear()
    browser.find(".adder input").send_keys("FIC-999", Keys.ENTER)
    browser.until(lambda: "no loop FIC-999" in browser.text(".adder .trouble"), "a loop that is not there is not refused")
    browser.press(".chosen-curves li:nth-child(2) button")
    browser.until(lambda: len(browser.all(".chosen-curves li")) == 3 and "FIC-102:pv" not in browser.run("decodeURIComponent(location.hash)"), "a curve can't be removed")
    browser.press(".chip-button:nth-child(1)")
    browser.until(lambda: "span=60" in browser.run("location.hash"), "the span is not in the address")
    browser.run("[...document.querySelectorAll('.trend .tools button')].find((b) => b.textContent.startsWith('Save view')).click()")
    browser.until(lambda: browser.all("dialog input[name=view]"), "no name of the view is asked for")
    browser.find("dialog input[name=view]").send_keys("night", Keys.ENTER)
    browser.until(lambda: "night" in browser.text(".trend .tools select"), "the saved view is not offered")
    kept = browser.run("location.href")
    browser.go(box, "journal")
    browser.go(box, "trends")
    browser.until(lambda: len(browser.all(".chosen-curves li")) == 3, "trends do not open with the loops last used")
    browser.check(len(browser.all(".tag-list button")) == 4, "not every loop is in the list of tags")
    browser.go(box, "journal")
    browser.driver.get(kept)
    browser.until(lambda: len(browser.all(".chosen-curves li")) == 3 and rows(browser) > 50, "the address does not bring the trend back")
    browser.run("document.querySelector('.plot').focus()")
    browser.driver.switch_to.active_element.send_keys(Keys.ARROW_LEFT)
    browser.until(lambda: f"{TAG} PV" in browser.text("[role=status]"), "the values at the cursor are not announced")
    csv = browser.run_async("const r = await fetch(document.querySelector('.under a.button').href); return [r.status, (await r.text()).slice(0, 10)];")
    browser.check(csv == [200, "time,pv,sp"], f"the CSV is {csv}")
    browser.run("(() => { window.saved = null; HTMLAnchorElement.prototype.click = function () { window.saved = [this.download, this.href]; }; })()")
    browser.run("[...document.querySelectorAll('.under button')].find((b) => b.textContent.includes('PNG')).click()")
    browser.until(lambda: browser.run("window.saved"), "no picture is made")
    browser.check(browser.run("window.saved[0]") == "trend.png" and browser.run("window.saved[1]").startswith("blob:"), f"the picture is {browser.run('window.saved')}")


def notes(box, browser):
    browser.go(box, f"loop/{TAG}")
    browser.until(lambda: rows(browser) > 100, "no rows")
    browser.run("[...document.querySelectorAll('.under button')].find((b) => b.textContent.startsWith('Note')).click()")
    browser.until(lambda: browser.all("dialog input[name=text]"), "no note is asked for")
    browser.find("dialog input[name=text]").send_keys("packing <b>tightened</b>", Keys.ENTER)
    browser.until(lambda: "packing <b>tightened</b>" in browser.text(".trend-notes") and "otto" in browser.text(".trend-notes"), "the note is not below the trend")
    browser.go(box, f"alarms/{TAG}/incident")
    browser.until(lambda: "packing <b>tightened</b>" in browser.text(".detail .trend-notes"), "the note is not with the incident")
    browser.go(box, "journal")
    browser.until(lambda: any("note" in row.text and "packing" in row.text and "otto" in row.text for row in browser.all(".lines tbody tr")), "the note is not in the journal")


def bell(box, browser):
    """While an alarm waits."""
    script = browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": LISTEN})["identifier"]
    browser.driver.get(box.url)
    browser.driver.refresh()
    browser.until(lambda: "to acknowledge" in browser.text(".summary"), "no alarm waits")
    browser.check(browser.run("document.title").startswith("(") and browser.find("link[rel=icon]").get_attribute("href").startswith("data:"), "the tab does not count")
    browser.check(browser.run("!document.querySelector('.question').hidden"), "no question about sound")
    browser.check(browser.run("window.heard.tones") == 0, "it sounds unasked")
    browser.screen(360, 760)
    browser.check(browser.run("!document.querySelector('.question').checkVisibility() && document.querySelector('.bell').checkVisibility()"), "on a phone the question about sound takes room")
    browser.screen()
    browser.find(".question button").click()
    browser.until(lambda: browser.all("dialog input[value=low]"), "no choice of sounds")
    browser.find("dialog input[value=low]").click()
    browser.find("dialog button[type=submit]").click()
    browser.until(lambda: browser.run("window.heard.tones > 0"), "an alarm that waits does not sound")
    browser.until(lambda: any(TAG in title for title in browser.run("window.heard.notes")), "no notification of it")
    browser.check(browser.run("document.querySelector('.question').hidden"), "it is asked again")
    name = lambda: browser.find(".bell").get_attribute("aria-label")
    browser.check("Sounds" in name(), f"the bell says {name()}")
    browser.find(".bell").click()
    browser.until(lambda: browser.all("dialog select[name=silence]"), "no silence is offered")
    browser.run("(() => { document.querySelector('dialog select').value = '5'; })()")
    browser.find("dialog button[type=submit]").click()
    browser.until(lambda: "Silent until" in name(), f"the silence has no time: {name()}")
    browser.driver.refresh()
    browser.until(lambda: "Silent until" in name(), "the silence is forgotten")
    browser.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", {"identifier": script})
    browser.run("localStorage.clear()")
