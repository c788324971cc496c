# SPDX-License-Identifier: Apache-2.0
"""An engineer tunes a loop: proposals from the newest step, their predicted effect, the
confirmed change, and the note that no file contains it."""
import time

TAG = "FIC-102"


def gains(box):
    return box.ask({"request": "loop", "loop": TAG})["gains"]


def step(box):
    """Makes a step of SP and lets the loop settle, for the identification."""
    now = box.ask({"request": "loop", "loop": TAG})["sp"]
    box.ask({"request": "set", "loop": TAG, "set_point": now + 1})
    accelerate = box.ask({"request": "describe"})["accelerate"]
    time.sleep(8 + 220 / accelerate)  # the recorder writes every 5 s


def propose(box, browser):
    browser.go(box, f"loop/{TAG}")
    browser.until(lambda: browser.all(".tuning dt"), "the loop's gains are not shown")
    browser.press(".proposals > button")
    browser.until(lambda: len(proposed(browser)) > 3, f"nothing is proposed: {browser.text('.tuning')}")
    browser.until(lambda: len(browser.all(".proposals .plot canvas")) == 2, "the answers are not drawn")


def proposed(browser):
    return browser.all(".proposals tbody tr")


def works(box, browser):
    before = gains(box)["in_force"]
    step(box)
    propose(box, browser)
    browser.check("recommended" in browser.text(".proposals tbody"), "no rule is recommended")
    browser.check("not in file" not in browser.text(".tuning").lower(), "gains of the file are shown as missing in the file")
    rows = [row.text for row in proposed(browser)]
    browser.check("Ms" in browser.text(".proposals thead") and "today" in rows[0], f"the table is {rows}")
    # Another rule is drawn in place of the recommended one.
    browser.run("[...document.querySelectorAll('.proposals input[name=tuning-rule]')].find((i) => !i.checked).click()")
    browser.until(lambda: "Apply" in browser.text(".proposals > .hands"), "nothing can be applied")
    browser.press(".proposals > .hands button")
    browser.until(lambda: browser.all("dialog .facts"), "no confirmation is requested")
    words = browser.text("dialog")
    browser.check(TAG in words and f"kp {before['kp']}" in words, f"the confirmation has not tag and old gains: {words}")
    browser.check(gains(box)["in_force"] == before, "gains act before they are confirmed")
    margin = browser.all("dialog input[name=margin]")
    if margin:
        browser.find("dialog button[type=submit]").click()
        browser.check(browser.all("dialog") and gains(box)["in_force"] == before, "gains with little margin act without a confirmation")
        margin[0].click()
    # Another client changes the gains meanwhile.
    box.ask({"request": "tune", "loop": TAG, "kp": 0.123, "ki": before["ki"], "kd": 0})
    browser.until(lambda: gains(box)["in_force"]["kp"] == 0.123, "another can't tune")
    browser.find("dialog button[type=submit]").click()
    browser.until(lambda: "kp 0.123" in browser.text("dialog .trouble"), f"a conflict is not reported: {browser.text('dialog')}")
    browser.check(gains(box)["in_force"]["kp"] == 0.123, "another's gains were overwritten unseen")
    browser.find("dialog button[type=submit]").click()
    browser.until(lambda: not browser.all("dialog"), f"not taken: {browser.text('dialog')}")
    now = gains(box)
    browser.check(now["not_in_file"] and now["in_force"] != before and now["file"] == before and "ella" in now["by"], f"in force are {now}")
    browser.until(lambda: f"kp: {now['in_force']['kp']}" in browser.text(".not-in-file code"), "no lines to paste")
    browser.check(f"kp {before['kp']}" in browser.text(".not-in-file"), "the values that a restart drops are not shown")
    browser.until(lambda: "not in file" in browser.text(".faceplate").lower(), "the faceplate does not say it")
    browser.go(box, "")
    browser.until(lambda: "not in file" in browser.text(".loops").lower(), "the tile does not say it")
    browser.go(box, "journal")
    browser.until(lambda: any("gains" in row.text and "not in file" in row.text and "ella" in row.text for row in browser.all(".lines tbody tr")), "the journal does not say it")


def not_for_a_sticking_valve(box, browser, tag):
    browser.go(box, f"loop/{tag}")
    browser.until(lambda: browser.all(".proposals > button"), "no button to propose gains")
    browser.press(".proposals > button")
    browser.until(lambda: "No gains are proposed" in browser.text(".proposals"), f"gains are proposed for a valve that sticks: {browser.text('.proposals')}")
    browser.check(not proposed(browser), "gains are listed for a valve that sticks")


def operators_look(box, browser):
    browser.go(box, f"loop/{TAG}")
    browser.until(lambda: "log in as an engineer" in browser.text(".tuning"), "an operator does not see who may tune")
    browser.check(not browser.all(".proposals"), "an operator is offered gains")
