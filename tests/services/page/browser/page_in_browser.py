#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Tests the page in a real browser (Debian's chromium, headless), with a real daemon on simulated
plants.

Usage: tests/services/page/browser/page_in_browser.py [--all] [--keep DIR]
Without --all (about a minute):
- log-in, the alarm of a sticking valve, its loop, its evidence and its acknowledgement
- the limits of a viewer, a daemon that is killed and returns, axe-core on the overview
--all adds:
- every view in both themes under axe-core
- one outage of eight watched loops, and the list of alarms (alone: --outage)
- the test that an explanation proposes (alone: --test)
- eight tabs and quick reloads (alone: --tabs)
- a day that the recorder still has, commands with their confirmation
- keyboard, themes, 360 pixels, paper, hostile words
--keep: folder for screenshots. Exit code 1: a check failed. 74: no program, browser or npm.
"""
import argparse
import os
import pathlib
import pwd
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import asked_reports  # noqa: E402
import many_tabs  # noqa: E402
import outage  # noqa: E402
import planned_test  # noqa: E402
import trends_and_bell  # noqa: E402
import tuning  # noqa: E402
import view_states  # noqa: E402
from box import BIN, PASSWORD, Box, Browser, WebDriverException  # noqa: E402
from selenium.webdriver.common.action_chains import ActionChains  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
TAG = "FIC-101"
HOSTILE = '<img src=x onerror="document.title=1">'
ROUTES = ["", f"loop/{TAG}", "alarms", f"alarms/{TAG}/incident", f"alarms/{TAG}/stiction", f"trends?curves={TAG}:pv,FIC-102:pv,FIC-103:co", "journal", "reports", "system"]
WATCHED = """loop: FIC-205
control: elsewhere
sample_time: 1
process_variable: {unit: m3/h, range: [0, 40]}
output: {unit: "%", range: [0, 100]}
io: {backend: feed, pv: {feed: "plant:PV"}, co: {feed: "plant:OP"}}
"""
# Its device is absent, and it has no read-back, so its output reaches no valve.
UNREACHED = """loop: FIC-206
sample_time: 0.2
process_variable: {unit: m3/h, range: [0, 40]}
controller: {action: reverse, kc: 0.6, ti: 8, set_point: {limits: [0, 40]}, output: {unit: "%", range: [0, 100]}}
start: {mode: automatic, set_point: 20, output: 50}
safe_actions: {stop: hold, bad_pv: hold, output_lost: hold, enable_open: 0, recovery: manual}
recording: {enabled: false}
io:
  backend: modbus
  poll_period: 0.2
  transmitter: {link: skid, unit: 1, register: {table: input, address: 0, type: f32}}
  positioner: {link: skid, unit: 2, command: {address: 100, type: u16, scale: 0.01}, comm_loss: none_accepted}
"""
LINK = "links: {skid: {transport: tcp, host: 127.0.0.1, port: 1, response_timeout: 0.1}}\n"
wrong = []


def axe(browser, where, source):
    """Checks that the shown page has no serious and no critical finding."""
    # Loaded by the debugger, because the page's policy refuses foreign scripts.
    browser.driver.execute_cdp_cmd("Runtime.evaluate", {"expression": source})
    found = browser.run_async("return (await axe.run(document, {resultTypes: ['violations']})).violations"
                              ".map((v) => [v.impact, v.id, v.nodes.map((n) => n.target.join(' ') + ': ' + n.failureSummary).slice(0, 3)]);")
    for impact, name, nodes in found:
        browser.check(impact not in ("serious", "critical"), f"{where}: axe: {impact}: {name}: {nodes}")


def drawn(browser, selector, colour=None):
    """Returns the number of canvas pixels that were drawn on, or that have the colour of that
    name."""
    return browser.run("""((selector, name) => {
      const canvas = document.querySelector(selector);
      if (!canvas || !canvas.width) return 0;
      const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
      const probe = document.createElement('canvas').getContext('2d');
      if (name) { probe.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim(); probe.fillRect(0, 0, 1, 1); }
      const [r, g, b] = name ? probe.getImageData(0, 0, 1, 1).data : [];
      let n = 0;
      for (let i = 0; i < data.length; i += 4) n += name ? data[i] === r && data[i + 1] === g && data[i + 2] === b : data[i + 3] > 0;
      return n;
    })(arguments[0], arguments[1])""", selector, colour)


def keep(browser, folder, name, full=False):
    if folder:
        browser.shot(folder / f"{name}.png", full)


def badge(browser):
    """Returns the number of waiting alarms in the menu. Empty: no alarm waits."""
    return browser.run("[...document.querySelectorAll('.nav .badge')].filter((b) => !b.hidden).map((b) => b.textContent).join()")


def knows_nothing(browser, where):
    """Checks that the page shows no information about the box before the log-in, not even that
    it is empty."""
    shown = browser.text("body")
    for word in ("No unacknowledged alarms", "acknowledge", "Live", "Old values", TAG, "L/min"):
        browser.check(word not in shown, f"{where}: the page shows {word!r}")
    browser.check(not browser.run("document.title").startswith("("), f"{where}: the title is {browser.run('document.title')!r}")
    browser.check(not badge(browser), f"{where}: the badge of the alarms stays")


def session_ends(box, browser):
    """Logs out in another tab, while the overview is open and an alarm waits."""
    browser.go(box)
    browser.until(lambda: browser.all(".tile") and "to acknowledge" in browser.text(".summary"), "no overview")
    browser.check(browser.run("document.title").startswith("("), "the title does not count the alarms that wait")
    browser.run_async("""const {csrf} = await (await fetch('/api/session')).json();
      await fetch('/api/logout', {method: 'POST', body: '{}', headers: {'Content-Type': 'application/json', 'X-CSRF-Token': csrf}});""")
    browser.until(lambda: not browser.all(".tile"), "values stay on the screen when the session has ended")
    knows_nothing(browser, "the session has ended")
    browser.until(lambda: browser.all("form.panel input[name=password]"), "no new log-in is requested")
    knows_nothing(browser, "logged out")


def alarm_comes(box, browser):
    browser.go(box)
    took = browser.until(lambda: "to acknowledge" in browser.text(".summary"), "no alarm of the sticking valve is raised", 900)
    print(f"alarm after {took:.0f} s" if took is not None else "no alarm")
    browser.until(lambda: browser.text(".tiles li:first-child .tag") == TAG, "the loop with the alarm is not the first")
    browser.check("Stiction" in browser.text(".tiles li:first-child .state"), f"its tile shows {browser.text('.tiles li:first-child')}")
    browser.until(lambda: drawn(browser, ".tiles li:first-child canvas") > 100, "its sparkline is empty")


def loop_shows(box, browser):
    """Checks the trend of a sticking valve: the band of the alarm, PV that cycles, a stem that
    rests while CO moves."""
    browser.go(box, f"loop/{TAG}")
    browser.until(lambda: len(browser.all(".plot canvas")) >= 2, "the trend has no plots")
    browser.until(lambda: int(browser.find(".panes").get_attribute("data-rows") or 0) > 200, "the trend has no rows")
    browser.until(lambda: drawn(browser, ".pane:nth-of-type(1) canvas", "measured") > 300, "PV is not drawn")
    browser.until(lambda: drawn(browser, ".pane:nth-of-type(2) canvas", "co") > 100, "CO is not drawn")
    browser.until(lambda: drawn(browser, ".pane:nth-of-type(1) canvas", "high") + drawn(browser, ".pane:nth-of-type(1) canvas", "low") > 200,
                  "the alarm is no band on the trend")
    browser.until(lambda: drawn(browser, ".phase canvas") > 500, "PV over CO is not drawn")
    stands, swing = browser.run_async("""
      const {from, to} = document.querySelector('.panes').dataset;
      const h = await (await fetch(`/api/loops/${a}/history?from_ms=${from}&to_ms=${to}&points=4000`)).json();
      let still = 0, moving = 0;
      for (let i = 60; i < h.t.length; i += 10) {
        if (h.co[i] === null || h.stem[i] === null || Math.abs(h.co[i] - h.co[i - 10]) < 0.01) continue;
        ++moving;
        still += Math.abs(h.stem[i] - h.stem[i - 10]) < 0.005;
      }
      const pv = h.pv.filter((v) => v !== null).slice(-1000);
      return [moving ? still / moving : 0, Math.max(...pv) - Math.min(...pv)];""", TAG)
    browser.check(stands > 0.4, f"the stem rests in {100 * stands:.0f} % of CO's moves: no sticking valve")
    browser.check(swing > 0.3, f"PV swings by {swing:.2f} L/min only")
    browser.until(lambda: "Control performance" in browser.text(".loop-rest"), "no condition indices")
    browser.until(lambda: browser.all(".windows tbody tr"), "no windows of the monitor")
    browser.check("backlash" in browser.text(".windows thead"), "the windows lack specialists")
    browser.check("specialists for" in browser.text(".faceplate .judges"), f"who judges is {browser.text('.faceplate .judges')!r}")
    browser.until(lambda: "PV bad" in browser.text(".loop-rest") and "10 s, 1 min" in browser.text(".loop-rest"), "the process alarms and their delays are not shown")


def evidence_shows(box, browser):
    browser.go(box, "alarms")
    browser.until(lambda: browser.all(".alarms tbody tr"), "the list of alarms is empty")
    browser.check("Stiction" in browser.text(".alarms"), "the incident has not the alarm's name")
    browser.press(f".alarms a[href='#/alarms/{TAG}/incident']")
    browser.until(lambda: "the valve" in browser.text(".about-alarm + .facts, .detail dl"), "the incident does not show its place")
    browser.press(f".its-alarms a[href='#/alarms/{TAG}/stiction']")
    browser.until(lambda: len(browser.text(".guide .action dd")) > 20, "the alarm does not say what to do")
    browser.until(lambda: len(browser.all(".evidence .plot canvas")) == 2, "the evidence is not drawn")
    browser.until(lambda: drawn(browser, ".evidence canvas", "measured") > 200, "the evidence is empty")
    browser.check("961 samples" in browser.text(".evidence"), f"the evidence is not 961 samples: {browser.text('.evidence')[:300]}")
    browser.check("loopwarden replay" in browser.text(".command code"), "no command to judge it once more")


def figures_show(box, browser):
    browser.go(box, "alarms")
    browser.press(".alarm-figures summary")
    browser.until(lambda: "Alarms per hour" in browser.text(".alarm-figures") and "at most 6" in browser.text(".alarm-figures"), "no figures of the alarms, or no targets")
    browser.until(lambda: "Stiction" in browser.text(".alarm-figures"), "the raised alarm is not among the most frequent")
    browser.run("(() => { const s = document.querySelector('.alarm-figures select'); s.value = '720'; s.dispatchEvent(new Event('change')); })()")
    browser.until(lambda: "From" in browser.text(".alarm-figures"), "figures have no span")


def viewer_cannot_write(box, browser):
    """Checks that a viewer can't write, neither by the page nor by a direct request."""
    browser.check(not browser.all(".hands button"), "a viewer is offered to act")
    browser.go(box, f"loop/{TAG}")
    browser.until(lambda: browser.all(".faceplate"), "no faceplate")
    browser.check(not browser.all(".hands button"), "a viewer is offered to operate")
    for path, body in ((f"/api/loops/{TAG}/alarms/stiction", {"action": "acknowledge"}),
                       (f"/api/loops/{TAG}/order", {"set": {"set_point": 4}, "confirm": {"tag": TAG, "old": 5, "new": 4}})):
        status = browser.run_async("""const {csrf} = await (await fetch('/api/session')).json();
          return (await fetch(a, {method: 'POST', body: JSON.stringify(b), headers: {'Content-Type': 'application/json', 'X-CSRF-Token': csrf}})).status;""", path, body)
        browser.check(status == 403, f"a viewer's POST to {path} gets {status}")


def acknowledge(box, browser):
    """Acknowledges the incident, and with it the alarm."""
    browser.go(box, f"alarms/{TAG}/incident")
    browser.press(".detail .hands button.main")
    browser.until(lambda: browser.all("dialog[open]"), "acknowledging does not ask")
    browser.find("dialog input[name=reason]").send_keys(HOSTILE)
    browser.find("dialog button[type=submit]").click()
    browser.until(lambda: not browser.all("dialog"), "the dialog stays")
    browser.until(lambda: "acknowledged" == browser.text(".about-alarm .state").strip(), "the alarm is not acknowledged")
    browser.go(box, "journal")
    browser.until(lambda: any("otto" in row.text and "acknowledge" in row.text for row in browser.all(".lines tbody tr")),
                  f"the journal does not show it: {browser.text('main')[:500]}")
    browser.check(HOSTILE in browser.text(".lines"), "the reason is not shown as it was written")
    browser.check(not browser.all("main img"), "a reason became markup")


def killed_and_back(box, browser):
    browser.go(box)
    browser.until(lambda: browser.all(".tile .pv .value"), "no tiles")
    browser.check(not browser.run("document.body.classList.contains('stale')"), "live values look stale")
    box.kill_daemon()
    took = browser.until(lambda: browser.run("document.body.classList.contains('stale') && !document.querySelector('.banner').hidden"),
                         "a dead daemon's values look fresh")
    print(f"stale {took:.2f} s after the daemon was killed" if took is not None else "never stale")
    browser.check("No values from loopwardend since" in browser.text(".banner"), f"the banner says {browser.text('.banner')}")
    struck = browser.run("getComputedStyle(document.querySelector('.tile .value')).textDecorationLine")
    browser.check("line-through" in struck, "old values look as new ones")
    box.start_daemon()
    took = browser.until(lambda: browser.run("!document.body.classList.contains('stale') && document.querySelector('.banner').hidden"), "values don't come back by themselves")
    print(f"back {took:.2f} s after the daemon answered" if took is not None else "never back")


# --- only with --all ---

def day_old(box, browser, spike_ms):
    """Shows a part of yesterday, with a spike of one sample that every decimation must keep."""
    browser.go(box, f"loop/{TAG}?from={spike_ms - 36_000_000}&to={spike_ms + 36_000_000}")
    pv = lambda: browser.run("[...document.querySelectorAll('.trend details:last-of-type tbody tr:first-child td')].map((e) => e.textContent)")
    browser.until(lambda: pv() and pv()[2] == "8.50", "the spike of yesterday is lost")
    before = browser.run("(({from, to}) => to - from)(document.querySelector('.panes').dataset)")
    over = browser.find(".plot .u-over")
    browser.run("arguments[0].scrollIntoView({block: 'center'})", over)
    width = over.size["width"]
    ActionChains(browser.driver).move_to_element_with_offset(over, -int(width * 0.02), 0).click_and_hold().move_by_offset(int(width * 0.04), 0).release().perform()
    span = lambda: browser.run("(({from, to}) => to - from)(document.querySelector('.panes').dataset)")
    browser.until(lambda: span() < before / 10, "drawing over the trend does not zoom")
    browser.until(lambda: drawn(browser, ".pane canvas", "measured") > 100, "no data of yesterday are drawn")
    for _ in range(8):
        browser.press("button[aria-label='Zoom in']")
    browser.until(lambda: "Every sample" in browser.text(".under"), "no zoom down to every sample")
    ActionChains(browser.driver).move_to_element(over).perform()
    browser.until(lambda: browser.text(".curves .curve:nth-child(2) .value").endswith("L/min"), "the cursor reads no PV with its unit")
    stamp = browser.run("new Date(arguments[0] + 7200000).toISOString().slice(0, 10)", spike_ms)
    browser.check(stamp in browser.text(".cursor-time"), f"the cursor's time is {browser.text('.cursor-time')}, not of {stamp} in Johannesburg")
    fine = span()
    def goes_back():
        # Repeated if a slow machine turned it into two clicks.
        ActionChains(browser.driver).double_click(browser.find(".plot .u-over")).perform()
        return span() > 1.5 * fine
    browser.until(goes_back, "a double click does not go back")
    csv = browser.run_async("const r = await fetch(document.querySelector('.under a[download]').href); return [r.status, (await r.text()).slice(0, 40)];")
    browser.check(csv[0] == 200 and csv[1].startswith("time,pv"), f"the CSV is {csv}")


def orders(box, browser):
    """Checks that the confirmation shows tag, old and new value, and that the value is set only
    after it."""
    tag = "FIC-102"
    browser.go(box, f"loop/{tag}")
    browser.until(lambda: len(browser.all(".hands button")) == 3, "an operator is not offered to operate")
    loop = lambda: next(one for one in box.ask({"request": "status"})["loops"] if one["name"] == tag)
    old = loop()["sp"]
    browser.press(".hands button:nth-of-type(2)")
    browser.until(lambda: browser.all("dialog input[name=value]"), "no field for the set point")
    field = browser.find("dialog input[name=value]")
    field.clear()
    field.send_keys("99", Keys.ENTER)
    browser.until(lambda: "from 0 to 9" in browser.text("dialog .trouble"), "a set point out of its limits is not refused")
    field.clear()
    field.send_keys("6.25", Keys.ENTER)
    browser.until(lambda: "Confirm" in browser.text("dialog h2"), "no confirmation is requested before the set point changes")
    words = browser.text("dialog")
    browser.check(all(word in words for word in (tag, f"{old:.2f} L/min", "6.25 L/min")), f"the confirmation says {words!r}")
    browser.check(loop()["sp"] == old, "the set point changed before it was confirmed")
    browser.check(browser.run("document.activeElement.textContent") == "Cancel", "the dialog's first button is not the harmless one")
    browser.find("dialog button.grave").click()
    browser.until(lambda: loop()["sp"] == 6.25, "the set point does not change")
    browser.until(lambda: "6.25" in browser.text(".bar-box:nth-child(2)"), "the faceplate does not show it")
    # Another client changes the value meanwhile.
    browser.press(".hands button:nth-of-type(2)")
    browser.until(lambda: browser.all("dialog input[name=value]"), "no field for the set point")
    field = browser.find("dialog input[name=value]")
    box.ask({"request": "set", "loop": tag, "set_point": 4.5})
    browser.until(lambda: loop()["sp"] == 4.5, "the other operator can't set")
    field.clear()
    field.send_keys("7", Keys.ENTER)
    browser.until(lambda: browser.all("dialog button.grave"), "no confirmation")
    browser.find("dialog button.grave").click()
    browser.until(lambda: "4.5" in browser.text("dialog .trouble"), f"what another has set is overwritten: {browser.text('dialog')}")
    browser.check(loop()["sp"] == 4.5, "what another has set was overwritten")
    words = browser.text("dialog .facts")
    browser.check("4.50 L/min" in words and "7.00 L/min" in words and "6.25" not in words, f"the dialog has not the value in force and the operator's: {words}")
    browser.check(f"Set by\nuid {os.getuid()}" in words, f"the dialog does not say who set it: {words}")
    browser.find("dialog").send_keys(Keys.ESCAPE)
    browser.until(lambda: not browser.all("dialog"), "Escape does not close the dialog")
    browser.press(".hands button:nth-of-type(1)")
    browser.until(lambda: browser.all("dialog input[value=manual]"), "no choice of modes")
    browser.find("dialog input[value=manual]").click()
    browser.find("dialog button[type=submit]").click()
    browser.until(lambda: browser.all("dialog button.grave"), "no confirmation of the mode")
    browser.find("dialog button.grave").click()
    browser.until(lambda: loop()["mode"] == "MAN" and "MAN" in browser.text(".mode.big"), "the mode does not change")


def shelve(box, browser):
    browser.go(box, f"alarms/{TAG}/stiction")
    browser.until(lambda: "Shelve" in browser.text(".detail .hands"), "no shelf is offered")
    browser.run("[...document.querySelectorAll('.detail .hands button')].find((b) => b.textContent.startsWith('Shelve')).click()")
    browser.until(lambda: browser.all("dialog[open]"), "shelving does not ask")
    browser.find("dialog button[type=submit]").click()
    browser.check(browser.all("dialog[open]"), "shelved without a reason")
    browser.find("dialog input[name=reason]").send_keys("repair on Friday")
    browser.find("dialog button[type=submit]").click()
    browser.until(lambda: browser.text(".about-alarm .state").strip() == "shelved", "the alarm is not on the shelf")
    browser.run("[...document.querySelectorAll('.detail .hands button')].find((b) => b.textContent.startsWith('Unshelve')).click()")
    browser.until(lambda: browser.all("dialog[open]"), "taking it off does not ask")
    browser.find("dialog button[type=submit]").click()
    browser.until(lambda: browser.text(".about-alarm .state").strip() == "unacknowledged", "it does not come off the shelf as a reminder")


def journal_searched(box, browser):
    browser.go(box, "journal")
    browser.until(lambda: browser.all(".lines tbody tr"), "the journal is empty")
    rows = lambda: [row.text for row in browser.all(".lines tbody tr")]
    browser.find("input[name=text]").send_keys("repair on friday", Keys.ENTER)
    browser.until(lambda: rows() and all("repair on Friday" in row for row in rows()), "the search finds other lines")
    link = browser.find("a[download='journal.csv']").get_attribute("href")
    csv = browser.run_async("return await (await fetch(a)).text();", link)
    browser.check("repair on Friday" in csv and "utc_ms" in csv.splitlines()[0] and HOSTILE not in csv, f"the CSV is {csv[:200]!r}")
    browser.find("input[name=text]").clear()
    browser.find("input[name=text]").send_keys("no line has this", Keys.ENTER)
    browser.until(lambda: "No matching entries" in browser.text("main"), "lines that don't match are shown")


def overview_used(box, browser):
    """Tests search, filters, order, table and arrows."""
    browser.go(box)
    tags = lambda: [e.text for e in browser.all(".tiles .tag")]
    browser.until(lambda: len(tags()) == 4, "not all loops are shown")
    search = browser.find("input[type=search]")
    search.send_keys("reflux")
    browser.until(lambda: tags() == ["FIC-103"], f"the search shows {tags()}")
    search.clear()
    search.send_keys(" ", Keys.BACKSPACE)
    browser.press("input[name=show][value=alarm]")
    browser.until(lambda: tags() == [TAG], f"the filter shows {tags()}")
    browser.press("input[name=show][value=all]")
    browser.until(lambda: len(tags()) == 4, "the filter stays")
    browser.run("document.querySelector('.tile a').focus()")
    browser.driver.switch_to.active_element.send_keys(Keys.ARROW_RIGHT)
    browser.check(browser.run("document.activeElement === document.querySelectorAll('.tile a')[1]"), "an arrow does not go to the next tile")
    browser.press("input[name=as][value=table]")
    browser.until(lambda: len(browser.all(".grid tbody tr")) == 4, "no table")
    browser.press(".grid th:nth-child(1) button")
    browser.until(lambda: browser.find(".grid th:nth-child(1)").get_attribute("aria-sort") == "ascending", "a sorted column does not say so")
    browser.check([e.text for e in browser.all(".grid tbody th a")] == ["FIC-101", "FIC-102", "FIC-103", "FIC-104"], "the table is not sorted")
    browser.press("input[name=as][value=tiles]")
    values = lambda: [browser.text(f".tile:nth-child({n}) .pv .value") for n in (1, 2, 3, 4)]
    first = values()
    browser.until(lambda: values() != first, "values stand still")


def focus_seen(browser, name):
    """Moves from the top through all elements that a keyboard reaches. Each one has a name and a
    frame, and is not under the bar at the bottom."""
    browser.run("document.querySelector('.skip').focus()")
    wrong_stops = []
    for _ in range(250):
        ActionChains(browser.driver).send_keys(Keys.TAB).perform()
        stop = browser.run("""(() => { const e = document.activeElement, s = getComputedStyle(e.matches('.chip input') ? e.nextElementSibling : e), r = e.getBoundingClientRect(), nav = document.querySelector('.nav');
          if (e === document.body) return null;
          const named = e.ariaLabel || e.labels?.[0] || e.innerText?.trim(), over = nav.getBoundingClientRect(), covered = !nav.contains(e) && over.top > innerHeight / 2 && r.top >= over.top;
          return [s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 2 && r.width > 0 && Boolean(named) && !covered, e.outerHTML.slice(0, 100)]; })()""")
        if stop is None:
            break
        if not stop[0]:
            wrong_stops.append(stop[1])
    browser.check(not wrong_stops, f"{name}: without a name, a frame or a place: {wrong_stops[:3]}")


def keyboard(box, browser):
    """Uses the page without a mouse: the skip link, the views, a tile, the trend, a dialog and
    back."""
    browser.go(box)
    browser.driver.refresh()
    browser.until(lambda: browser.all(".tile"), "no tiles")
    press = lambda *keys: ActionChains(browser.driver).send_keys(*keys).perform()
    press(Keys.TAB)
    browser.check(browser.run("document.activeElement.className") == "skip", "the first stop is not the skip link")
    box_of = "(({top, width}) => [top, width])(document.activeElement.getBoundingClientRect())"
    browser.check(browser.run(box_of)[0] >= 0, "the skip link is not seen when it has the focus")
    press(Keys.ENTER)
    browser.check(browser.run("document.activeElement.id") == "content", "the skip link does not skip")
    browser.run("document.querySelector('.tile a').focus()")
    press(Keys.ENTER)
    browser.until(lambda: browser.run("document.querySelector('main').dataset.view") == "loop", "Enter on a tile does not open it")
    browser.until(lambda: browser.run("document.activeElement.tagName") == "H1", "the focus does not go to the view's head")
    browser.until(lambda: int(browser.find(".panes").get_attribute("data-rows") or 0) > 100, "no rows")
    browser.run("document.querySelector('.plot').focus()")
    time_text = browser.text(".cursor-time")
    press(Keys.ARROW_LEFT, Keys.ARROW_LEFT)
    browser.until(lambda: browser.text(".cursor-time") != time_text and "PV" in browser.text("[role=status]"), "arrows don't move the cursor, or are not announced")
    span = lambda: browser.run("(({from, to}) => to - from)(document.querySelector('.panes').dataset)")
    whole = span()
    press("+")
    browser.until(lambda: span() < 0.7 * whole, "the key + does not zoom")
    browser.run("document.querySelector('.hands button').focus()")
    press(Keys.ENTER)
    browser.until(lambda: browser.all("dialog[open]"), "Enter does not open the dialog")
    for _ in range(12):
        press(Keys.TAB)
        browser.check(browser.run("!document.activeElement || document.activeElement === document.body || document.querySelector('dialog').contains(document.activeElement)"),
                      "the focus leaves the dialog")
    press(Keys.ESCAPE)
    browser.until(lambda: browser.run("document.activeElement.closest('.hands') !== null"), "the focus does not come back from the dialog")


def themes(box, browser):
    paper = lambda: browser.run("getComputedStyle(document.body).backgroundColor")
    browser.driver.get(box.url + "/#/")
    browser.until(lambda: browser.all(".theme"), "no switch of themes")
    browser.screen(scheme="light")
    light = paper()
    browser.screen(scheme="dark")
    dark = paper()
    browser.check(light != dark, "the system's theme has no effect")
    browser.run("(() => { const s = document.querySelector('.theme'); s.value = 'light'; s.dispatchEvent(new Event('change')); })()")
    browser.check(paper() == light, "the switch does not overrule the system")
    browser.driver.refresh()
    browser.until(lambda: browser.all(".theme"), "no switch of themes")
    browser.check(paper() == light, "the theme is forgotten")
    browser.run("(() => { const s = document.querySelector('.theme'); s.value = 'system'; s.dispatchEvent(new Event('change')); })()")
    browser.check(paper() == dark, "the system's theme does not come back")


def plain(route):
    """Returns the route as part of a file's name."""
    return re.sub("[^A-Za-z0-9-]+", "-", route) or "overview"


def nothing_cut_off(browser, name, width):
    """Returns cut-off texts of the lists that are read from left to right: alarms, journal,
    reports."""
    cut = browser.run("""[...document.querySelectorAll('.as-cards th, .as-cards td')].filter((e) => e.offsetParent && !e.closest('thead') && !e.matches('.alarms .what') &&
      (e.getBoundingClientRect().right > Math.min(arguments[0], e.closest('.scroller').getBoundingClientRect().right) + 1 || e.scrollWidth > e.clientWidth + 1)).map((e) => e.textContent).slice(0, 3)""", width)
    browser.check(not cut, f"{name}: cut off: {cut}")


def folded_on_a_phone(browser):
    """Checks that rarely needed parts of a loop take one line until they are opened."""
    browser.check(not browser.all(".folding[open]"), "a section of the loop is open on a phone")
    high = browser.run("document.documentElement.scrollHeight")
    browser.check(high < 3500, f"a loop is {high} pixels long on a phone")
    browser.run("[...document.querySelectorAll('.folding > summary')].forEach((one) => one.click())")
    browser.until(lambda: browser.run("[...document.querySelectorAll('.folding')].every((one) => one.open && one.scrollHeight > 60)"), "a section does not open")


def narrow_and_paper(box, browser, source, folder):
    for width in (360, 1280, 3840):
        browser.screen(width, 2160 if width > 1000 else 760)
        for route in ROUTES:
            browser.go(box, route)
            name = f"{width}-{plain(route)}"
            browser.until(lambda: browser.text("main").strip() and "Loading" not in browser.text("main"), f"{name} stays empty")
            if width == 360 and route.startswith("loop/"):
                folded_on_a_phone(browser)
            wide = browser.run("document.documentElement.scrollWidth")
            browser.check(wide <= width, f"{name}: {wide} pixels wide on a screen of {width}")
            nothing_cut_off(browser, name, width)
            if not route:
                out = browser.run("[...document.querySelectorAll('.tile')].filter((t) => [...t.querySelectorAll('.pair .value, .pair .name')].some((e) => e.getBoundingClientRect().right > t.getBoundingClientRect().right)).map((t) => t.innerText)")
                browser.check(not out, f"{name}: a value does not fit its tile: {out}")
            if width == 360:
                small = browser.run("""[...document.querySelectorAll('.nav a, .summary, main button, main .button, main select')].filter((e) => e.offsetParent && !e.closest('table'))
                  .map((e) => [e.textContent.slice(0, 20), Math.round(e.getBoundingClientRect().height)]).filter(([, h]) => h < 32)""")
                browser.check(not small, f"{name}: too small for a finger: {small[:4]}")
                axe(browser, name, source)
                focus_seen(browser, name)
            keep(browser, folder, name)
    browser.screen()
    for route in ROUTES:
        browser.go(box, route)
        browser.until(lambda: browser.text("main").strip(), f"{route}: empty")
        browser.media("print")
        for part in (".nav", ".hands", ".theme"):
            browser.check(browser.run("[...document.querySelectorAll(arguments[0])].every((e) => getComputedStyle(e).display === 'none')", part), f"{route}: {part} on paper")
        pdf = browser.pdf()
        browser.check(pdf.startswith(b"%PDF") and len(pdf) > 8000, f"{route}: does not print")
        if folder:
            (folder / f"paper-{plain(route)}.pdf").write_bytes(pdf)
        browser.media("")


def every_view(box, browser, source, folder):
    for scheme in ("dark", "light"):
        browser.screen(scheme=scheme)
        for route in ROUTES:
            browser.go(box, route)
            name = f"{scheme}-{plain(route)}"
            browser.until(lambda: browser.text("main").strip() and "Loading" not in browser.text("main"), f"{name} stays empty")
            if route.startswith("loop"):
                browser.until(lambda: browser.all(".windows tbody tr"), f"{name}: no windows")
            axe(browser, name, source)
            focus_seen(browser, name)
            keep(browser, folder, name, full=route.startswith(("loop/", "alarms/")))
        browser.go(box, f"alarms/{TAG}/stiction")
        browser.press(".detail .hands button")
        browser.until(lambda: browser.all("dialog[open]"), "no dialog")
        axe(browser, f"{scheme}-dialog", source)
        browser.find("dialog").send_keys(Keys.ESCAPE)
    browser.screen()


def reports_and_system(box, browser):
    browser.go(box, "reports")
    browser.until(lambda: "Gap" in browser.text("main"), "the report in the state directory is not listed")
    link = browser.find("main table a")
    browser.check(link.get_attribute("rel") == "noopener" and link.get_attribute("target") == "_blank", "a report opens with a hand on this page")
    policy = browser.run_async("const r = await fetch(a); return [r.status, r.headers.get('Content-Security-Policy')];", link.get_attribute("href"))
    browser.check(policy[0] == 200 and policy[1].startswith("sandbox"), f"a report has no sandbox: {policy}")
    browser.go(box, "system")
    browser.until(lambda: "Loops connected" in browser.text("main"), "the box does not say how it is")
    box.ask({"request": "reload"})
    browser.until(lambda: "reload" in browser.text(".changes") and f"uid {os.getuid()}" in browser.text(".changes"), "a reload is no change of the box")
    browser.check("Wake-up" not in browser.text("main"), "counters appear above more important data")
    for _ in range(2):
        browser.run("document.querySelectorAll('main details:not([open]) > summary').forEach((e) => e.click())")
    browser.until(lambda: "Wake-up" in browser.text("main") and len(browser.all(".histogram tbody tr")) > 2, "no histogram of the cycles")
    browser.check(any(unit in browser.text("main").split("bytes sent")[-1][:20] for unit in ("kB", "MB")), "bytes have no unit")


def make_report(box):
    """Makes a gap report in the state directory, of a record with a long path, as evidence has."""
    models = pathlib.Path(__file__).resolve().parents[4] / "examples/models"
    record, sticky = box.folder / f"{'evidence-' * 12}minutes.csv", box.folder / "sticky.yaml"
    sticky.write_text((models / "plant1.yaml").read_text(encoding="utf-8").replace("from: 120, ramp: 180", "from: 0, ramp: 1")
                      .replace("[[0, 4], [30, 5]]", "[[0, 4], [20, 5.5], [90, 4.2], [160, 6]]"), encoding="utf-8")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "check": True}
    subprocess.run([BIN / "loopwarden", "simulate", sticky, "--duration", "240", "--out", record], **quiet)
    subprocess.run([BIN / "loopwarden", "gap", record, "--model", models / "plant1-believed.yaml", "--out", box.state / "gap-FIC-101"], **quiet)


def axe_source():
    path = HERE / "node_modules/axe-core/axe.min.js"
    if not path.exists():
        subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=HERE, check=True, stdout=subprocess.DEVNULL)
    return path.read_text(encoding="utf-8")


def tuned(box, browser, source, folder):
    tuning.operators_look(box, browser)
    browser.log_out()
    browser.log_in(box, "ella")
    tuning.not_for_a_sticking_valve(box, browser, TAG)
    tuning.works(box, browser)
    tuning.propose(box, browser)
    axe(browser, "tuning", source)
    keep(browser, folder, "tuning", full=True)
    browser.log_out()
    browser.log_in(box, "otto")


def everything(box, browser, source, folder, spike_ms):
    reports_and_system(box, browser)
    asked_reports.asked(box, browser, TAG)
    browser.log_out()
    browser.log_in(box, "otto")
    day_old(box, browser, spike_ms)
    trends_and_bell.several_loops(box, browser)
    trends_and_bell.notes(box, browser)
    overview_used(box, browser)
    orders(box, browser)
    shelve(box, browser)
    tuned(box, browser, source, folder)
    trends_and_bell.bell(box, browser)
    journal_searched(box, browser)
    keyboard(box, browser)
    themes(box, browser)
    every_view(box, browser, source, folder)
    narrow_and_paper(box, browser, source, folder)


def alarms_of_the_box(box, browser, source, folder):
    """Checks that a waiting alarm is in tab and badge, open in the list, and lowers the box's
    health. It is acknowledged as others."""
    browser.go(box, "alarms")
    browser.until(lambda: "Certificate expires soon" in browser.text(".alarms"), f"an alarm of the box is not in the list: {browser.text('main')[:300]}")
    browser.until(lambda: browser.run("document.title").startswith("(") and badge(browser), "an alarm of the box is not counted")
    axe(browser, "alarms of the box", source)
    browser.go(box, "system")
    browser.until(lambda: "warning" in browser.text(".verdict"), f"the box's verdict is {browser.text('.verdict')!r}")
    browser.check("Certificate expires soon" in browser.text(".warnings") and "none.crt" in browser.text(".warnings") and "FIC-206" in browser.text(".warnings"), f"its warnings are {browser.text('.warnings')!r}")
    browser.until(lambda: "Certificate expires soon" in browser.text(".changes"), "it is no change of the box")
    browser.press(".warnings a[href='#/alarms/box/certificate_expires']")
    browser.until(lambda: len(browser.text(".guide .action dd")) > 20, "an alarm of the box does not say what to do")
    browser.check("twin" not in browser.text(".detail").lower() and "Evidence" not in browser.text(".detail"), "an alarm of the box has a valve's twin or evidence")
    keep(browser, folder, "alarm-of-the-box")
    browser.press(".detail .hands button.main")
    browser.until(lambda: browser.all("dialog[open]"), "acknowledging does not ask")
    browser.find("dialog button[type=submit]").click()
    browser.until(lambda: browser.text(".about-alarm .state").strip() == "acknowledged", "the box's alarm is not acknowledged")
    browser.check("OK" not in browser.text(".verdict") or not browser.all(".verdict"), "an alarm that is on no longer counts")
    browser.go(box, "journal?loop=box")
    browser.until(lambda: any("The box" in row.text and "acknowledge" in row.text for row in browser.all(".lines tbody tr")), f"the journal of the box is {browser.text('main')[:300]}")


def whether_it_acts(source, folder):
    """Checks that a faceplate shows at once whether its loop acts: a watched loop without buttons, a
    loop on a model, and a loop whose output reaches no valve. The box has a separate alarm for a
    missing certificate."""
    box = Box(healthy=1, accelerate=1)
    daemon = box.folder / "config/loopwardend.yaml"
    user = pwd.getpwuid(os.getuid()).pw_name
    daemon.write_text(daemon.read_text(encoding="utf-8") + f"feeders: {{plant: {{user: {user}}}}}\ncertificates: [{box.folder}/none.crt]\n{LINK}", encoding="utf-8")
    (box.folder / "config/loops.d/0002-unreached.yaml").write_text(UNREACHED, encoding="utf-8")
    (box.folder / "config/loops.d/0000-watched.yaml").write_text(WATCHED, encoding="utf-8")
    with tempfile.TemporaryDirectory() as profile, box, Browser(profile, wrong) as browser:
        browser.screen()
        browser.log_in(box, "otto")
        browser.go(box, "loop/FIC-102")
        browser.until(lambda: len(browser.all(".hands button")) == 3, "a loop controlled here has no buttons")
        browser.until(lambda: "Acts, simulated" in browser.text(".acts"), f"a simulated loop shows {browser.text('.acts')!r}")
        browser.go(box, "loop/FIC-205")
        browser.until(lambda: "Another controller runs this loop" in browser.text(".faceplate"), "nobody says who controls")
        browser.check(not browser.all(".hands button"), "a watched loop can be operated")
        browser.go(box, "loop/FIC-206")
        browser.until(lambda: "Not written" in browser.text(".acts"), f"a loop whose output reaches no valve shows {browser.text('.acts')!r}")
        browser.go(box)
        tile = lambda: next((one.text for one in browser.all(".tile") if "FIC-206" in one.text), "")
        browser.until(lambda: tile() and "normal" not in tile().splitlines(), f"its tile says {tile()!r}")
        keep(browser, folder, "acts")
        alarms_of_the_box(box, browser, source, folder)


def reports_of_records(folder):
    """Requests reports of a loop with a twin, and of a loop at rest without one. No alarm is
    raised, because its explanation would be made first."""
    box = Box(healthy=1, sticking=False)
    loop = box.folder / "config/loops.d/0000.yaml"
    loop.write_text(loop.read_text(encoding="utf-8").replace("plant1}", f"plant1, twin: {box.folder}/calm.yaml}}"), encoding="utf-8")
    with tempfile.TemporaryDirectory() as profile, box, Browser(profile, wrong) as browser:
        browser.screen()
        browser.log_in(box, "ella")
        asked_reports.made_of_the_record(box, browser, TAG, "FIC-102")
        keep(browser, folder, "asked-reports", full=True)
        browser.quiet("reports of records", allowed=("getImageData", "status of 401"))


def smoke(box, browser, source, options):
    browser.driver.get(box.url)
    browser.until(lambda: browser.all("form.panel input[name=password]"), "no log-in is requested")
    browser.until(lambda: browser.all("form.panel button.main"), "no form")
    knows_nothing(browser, "log-in")
    browser.find("form.panel input[name=user]").send_keys("vera")
    browser.find("form.panel input[name=password]").send_keys("wrong " + PASSWORD)
    browser.find("form.panel button[type=submit]").click()
    browser.until(lambda: "wrong" in browser.text(".trouble"), "a wrong password is not reported")
    axe(browser, "log-in", source)
    browser.log_in(box, "vera")
    alarm_comes(box, browser)
    axe(browser, "overview", source)
    evidence_shows(box, browser)
    viewer_cannot_write(box, browser)
    figures_show(box, browser)
    session_ends(box, browser)
    browser.log_in(box, "otto")
    loop_shows(box, browser)
    keep(browser, options.keep, "loop", full=True)
    acknowledge(box, browser)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--all", action="store_true", help="everything")
    parser.add_argument("--outage", action="store_true", help="only the outage and the list of alarms")
    parser.add_argument("--test", action="store_true", help="only the test that an explanation proposes")
    parser.add_argument("--tabs", action="store_true", help="only eight tabs and quick reloads")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for screenshots and PDFs")
    parser.add_argument("--port", type=int, default=0, help="of the page; any free one else")
    options = parser.parse_args()
    for program in ("loopwardend", "loopwarden-page", "loopwarden"):
        if not os.access(BIN / program, os.X_OK):
            print(f"page_in_browser: no {BIN}/{program}: build the release preset first", file=sys.stderr)
            return 74
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    try:
        source = axe_source()
        if options.test:
            planned_test.tried(wrong, axe, source, keep, options.keep)
            return 1 if wrong else 0
        if options.tabs:
            many_tabs.tried(wrong)
            return 1 if wrong else 0
        if options.outage:
            outage.tried(wrong, axe, source)
            return 1 if wrong else 0
        box = Box(port=options.port)
        spike_ms = box.write_old_segment()
        long_unit = box.folder / "config/loops.d/0002.yaml"
        long_unit.write_text(long_unit.read_text(encoding="utf-8").replace("unit: L/min", 'unit: "kg/(m² h) at 20 °C"'), encoding="utf-8")
        if options.all:
            make_report(box)
        with tempfile.TemporaryDirectory() as profile, box, Browser(profile, wrong) as browser:
            browser.screen()
            smoke(box, browser, source, options)
            if options.all:
                everything(box, browser, source, options.keep, spike_ms)
            # The browser reports every error answer, also the intended ones.
            browser.quiet("page", allowed=("getImageData", "status of 401", "status of 403", "status of 409"))
            if options.all:
                view_states.stale(box, browser)
                view_states.figures_of_alarms(box, browser)
                browser.log_out()
                view_states.logged_out(box, browser)
                browser.log_in(box, "vera")
                view_states.first_seconds(box, browser)
                view_states.no_answer(box, browser)
            killed_and_back(box, browser)
            if options.all:
                view_states.never_heard_of(box, browser)
            browser.quiet("dead daemon", allowed=("getImageData", "status of 401", "status of 503", "ERR_"))
        if options.all:
            outage.tried(wrong, axe, source)
            planned_test.tried(wrong, axe, source, keep, options.keep)
            many_tabs.tried(wrong)
            whether_it_acts(source, options.keep)
            reports_of_records(options.keep)
            view_states.no_data(wrong)
    except (WebDriverException, OSError, subprocess.CalledProcessError) as error:
        print(f"page_in_browser: {error}", file=sys.stderr)
        return 74
    print(f"{len(wrong)} wrong" if wrong else "all right")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
