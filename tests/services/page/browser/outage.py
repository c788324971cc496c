# SPDX-License-Identifier: Apache-2.0
"""Tests one outage of eight watched loops: one alarm that names them, its place on tiles, list and
System view. Then the list of alarms: order, filters, selection, height of its rows, keyboard, phone."""
import json
import os
import pwd
import socket
import tempfile
import threading
import time

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from box import Box, Browser

LOOP = """loop: {tag}
control: elsewhere
area: {area}
sample_time: 1
process_variable: {{unit: m3/h, range: [0, 40]}}
output: {{unit: "%", range: [0, 100]}}
io: {{backend: feed, pv: {{feed: "plant:{tag}.PV"}}, co: {{feed: "plant:{tag}.OP"}}}}
"""
TAGS = [f"FIC-{n}" for n in range(201, 209)]
SERVER = "server opc.tcp://dcs:4840"


class Feeder(threading.Thread):
    """Sends values of all loops. `lost`: the server of all is lost. `bad`: tags with a bad value."""

    def __init__(self, path):
        super().__init__(daemon=True)
        self.path, self.lost, self.bad, self.over = str(path), False, set(), False

    def run(self):
        with socket.socket(socket.AF_UNIX) as feed:
            feed.connect(self.path)
            while not self.over:
                feed.sendall((json.dumps({"values": [one for tag in TAGS for one in self.of(tag)]}) + "\n").encode())
                time.sleep(0.25)

    def of(self, tag):
        for name, value in ((f"{tag}.PV", 20 + time.time() % 2), (f"{tag}.OP", 50 + time.time() % 2)):
            if self.lost:
                yield {"name": name, "value": None, "quality": "bad", "reason": "link", "source": SERVER}
            elif tag in self.bad:
                yield {"name": name, "value": None, "quality": "bad"}
            else:
                yield {"name": name, "value": value}


def texts(browser, selector):
    """In one call, because the list is made again with each change."""
    return browser.run("[...document.querySelectorAll(arguments[0])].map((one) => one.innerText)", selector)


def rows(browser):
    return texts(browser, ".alarms tbody tr")


def one_alarm(box, browser, feeder):
    browser.go(box)
    browser.until(lambda: len(browser.all(".tile")) == len(TAGS) + 1 and "–" not in browser.text(".tile:nth-child(1) .pv .value"), "no values", 60)
    feeder.lost = True
    browser.until(lambda: "to acknowledge" in browser.text(".summary"), "a lost server raises no alarm", 60)
    browser.check("1 to acknowledge" in browser.text(".summary"), f"one outage is {browser.text('.summary')!r}")
    browser.until(lambda: sum("Connection lost, suppressed" in tile for tile in texts(browser, ".tile")) == len(TAGS), "not every tile shows that its alarm is suppressed", 30)
    browser.go(box, "alarms")
    browser.until(lambda: len(rows(browser)) == 1 and SERVER in rows(browser)[0], f"the alarm does not name its server: {rows(browser)}")
    browser.press(".alarms a[href='#/alarms/box/connection_lost']")
    browser.until(lambda: all(tag in browser.text(".detail") for tag in TAGS), "the alarm does not name its loops")
    browser.go(box, "system")
    browser.until(lambda: browser.text("main section h2") == "Connections" and SERVER in browser.text("main section"), f"the System view does not begin with the connections: {browser.text('main')[:200]}")
    feeder.lost = False
    browser.go(box)
    browser.until(lambda: not any("suppressed" in tile for tile in texts(browser, ".tile")), "tiles stay suppressed", 60)
    browser.check("1 to acknowledge" in browser.text(".summary"), f"after the outage {browser.text('.summary')!r}")


def list_used(box, browser, feeder):
    feeder.bad = {"FIC-203", "FIC-207"}
    browser.go(box, "alarms")
    browser.until(lambda: len(rows(browser)) == 3, f"not every alarm is there: {rows(browser)}", 60)
    high = browser.run("[...document.querySelectorAll('.alarms tbody tr')].map((row) => row.getBoundingClientRect().height)")
    browser.check(max(high) <= 44, f"rows are {high} pixels high")
    loops = lambda: texts(browser, ".alarms tbody .owner")
    browser.run("document.querySelector('.alarms thead button[data-key=\"sort loop\"]').focus()")
    ActionChains(browser.driver).send_keys(Keys.ENTER).perform()
    browser.until(lambda: loops() == ["FIC-203", "FIC-207", "The box"], f"sorted by loop: {loops()}")
    browser.check(browser.run("document.activeElement.dataset.key") == "sort loop", "the focus leaves the head of the column")
    browser.press(".alarms thead button[data-key='sort loop']")
    browser.until(lambda: loops() == ["The box", "FIC-207", "FIC-203"], f"sorted by loop, turned: {loops()}")
    select = lambda name, value: browser.run("((select, value) => { select.value = value; select.dispatchEvent(new Event('change')); })([...document.querySelectorAll('.list select')].find((one) => one.ariaLabel === arguments[0]), arguments[1])", name, value)
    select("Area", "Unit 3")
    browser.until(lambda: loops() == ["FIC-207"], f"in the area: {loops()}")
    select("Area", "")
    select("Source", "plant")
    browser.until(lambda: sorted(loops()) == ["FIC-203", "FIC-207"], f"of the source: {loops()}")
    select("Source", "")
    browser.find(".list input[type=search]").send_keys("203")
    browser.until(lambda: sorted(loops()) == ["FIC-203", "The box"], f"of the search, also in the box's text: {loops()}")
    browser.find(".list input[type=search]").clear()
    browser.find(".list input[type=search]").send_keys(" ", Keys.BACKSPACE)
    browser.until(lambda: len(loops()) == 3, "the search stays")
    # By keys: the box in the head, then the button.
    browser.run("document.querySelector('.alarms thead input').focus()")
    ActionChains(browser.driver).send_keys(Keys.SPACE).perform()
    browser.until(lambda: "Acknowledge 3" in browser.text(".list form"), "not all are selected")
    browser.press(".list form button.main")
    browser.until(lambda: len(browser.all("dialog li")) == 3, "the dialog does not name the alarms")
    browser.find("dialog input[name=reason]").send_keys("server restarted", Keys.ENTER)
    browser.until(lambda: not browser.all("dialog") and not any("unacknowledged" in row for row in rows(browser)), f"not all are acknowledged: {rows(browser)}", 30)


def marked(browser):
    """An active and a cleared alarm differ without colour."""
    browser.until(lambda: browser.all(".condition.on"), "no active alarm")
    fill = browser.run("getComputedStyle(document.querySelector('.condition.on')).backgroundColor")
    browser.check(fill not in ("transparent", "rgba(0, 0, 0, 0)"), "an active alarm has no filled mark")


def on_a_phone(box, browser, axe, source):
    browser.screen(390, 844)
    browser.go(box, "alarms")
    browser.until(lambda: browser.all(".alarms tbody tr"), "no alarms")
    browser.check(browser.run("document.querySelector('.head').getBoundingClientRect().height") <= 84, "the header takes more than a tenth of the screen")
    top = lambda what: browser.run(f"document.querySelector('.alarms tbody tr {what}').getBoundingClientRect().top")
    browser.check(top(".owner") < top(".what") < top(".state"), "tag and alarm are not first")
    loops = lambda: texts(browser, ".alarms tbody .owner")
    browser.run("document.querySelector('.list select.order').focus()")
    browser.find(".list select.order").send_keys("Urgent", Keys.ENTER)
    browser.until(lambda: loops() == ["The box", "FIC-203", "FIC-207"], f"urgent first on a phone: {loops()}")
    browser.find(".list select.order").send_keys("Loop", Keys.ENTER)
    browser.until(lambda: loops() == ["FIC-203", "FIC-207", "The box"], f"sorted by loop on a phone: {loops()}")
    browser.check(browser.run("document.activeElement.className") == "order", "the focus leaves the select")
    axe(browser, "alarms on a phone", source)
    browser.press(".menu")
    browser.until(lambda: browser.run("document.querySelector('.theme').checkVisibility()"), "theme and user can't be opened")
    axe(browser, "menu on a phone", source)
    browser.screen()


def tried(wrong, axe, source):
    box = Box(healthy=0, accelerate=1, sticking=False)
    daemon = box.folder / "config/loopwardend.yaml"
    daemon.write_text(daemon.read_text(encoding="utf-8") + f"feeders: {{plant: {{user: {pwd.getpwuid(os.getuid()).pw_name}}}}}\n", encoding="utf-8")
    for k, tag in enumerate(TAGS):
        (box.folder / f"config/loops.d/{tag}.yaml").write_text(LOOP.format(tag=tag, area="Unit 2" if k < 4 else "Unit 3"), encoding="utf-8")
    with tempfile.TemporaryDirectory() as profile, box, Browser(profile, wrong) as browser:
        feeder = Feeder(box.folder / "feed.sock")
        feeder.start()
        browser.screen(1440, 900)
        browser.log_in(box, "otto")
        one_alarm(box, browser, feeder)
        list_used(box, browser, feeder)
        marked(browser)
        axe(browser, "list of alarms", source)
        on_a_phone(box, browser, axe, source)
        feeder.over = True
        feeder.join()
        browser.quiet("outage", allowed=("getImageData", "status of 401"))
