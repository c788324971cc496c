# SPDX-License-Identifier: Apache-2.0
"""An engineer carries out the test that an explanation proposes: two steps, the progress, the stop,
the decision, and the loop as it was."""
import json
import re
import subprocess
import tempfile
import time
import zlib

from box import BIN, ROOT, Box, Browser
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

TAG = "FIC-101"
EVIDENCE = f"20261129T024623148Z-{TAG}-model_gap"
PART = ".planned-test"


def box_with_a_test():
    """Returns a box whose loop had an alarm before the start. Its explanation leaves two causes."""
    box = Box(healthy=0, accelerate=2)  # the next explanation is made after ten minutes of the loop
    settle = ROOT / "examples/settle"
    evidence = box.state / "evidence" / EVIDENCE
    evidence.mkdir(parents=True)
    record = box.folder / "record.csv"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "check": True}
    subprocess.run([BIN / "loopwarden", "simulate", settle / "plant.yaml", "--out", record], **quiet)
    subprocess.run([BIN / "loopwarden", "gap", record, "--model", settle / "model.yaml", "--out", box.folder / "gap"], **quiet)
    plan = (box.folder / "gap/next_test.yaml").read_text(encoding="utf-8")
    plan = re.sub(r"(?m)^model: .*", 'model: "twin.yaml"', f'loop: "{TAG}"\n{plan}')
    start = re.search(r"(?m)^from: (\S+)", plan)[1]
    (evidence / "twin.yaml").write_text((settle / "model.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    (evidence / "next_test.record.csv").write_text((box.folder / "gap/next_test.record.csv").read_text(encoding="utf-8"), encoding="utf-8")
    now_ms = int(1000 * time.time())
    (evidence / "evidence.json").write_text(json.dumps({"format": "loopwarden-evidence", "format_version": 3, "loop": TAG, "alarm": "model_gap", "raised_ms": now_ms}), encoding="utf-8")
    (evidence / "explanation.json").write_text(json.dumps({
        "alarm": "model_gap", "final_name": None, "raised_ms": now_ms, "ended_ms": now_ms, "verdict": "unexplained", "effects": [], "gap_closed": None, "agrees": False,
        "from_s": None, "sentence": "Stiction or a drive with a dead band explains the record.", "next_test": {"text": "To decide between them: a small test of SP."}, "first": None}), encoding="utf-8")
    alarm = {"loop": TAG, "alarm": "model_gap", "state": 1, "shelved_until_ms": 0, "raised_ms": now_ms, "changed_ms": now_ms, "times_raised": 1, "severity_percent": 0.0, "worst_severity_percent": 0.0}
    text = json.dumps({"revision": 1, "alarms": [alarm], "incidents": {}})
    (box.state / "alarm-state.json").write_text(f"{zlib.crc32(text.encode()):08x}\n{text}", encoding="utf-8")
    loop = box.folder / "config/loops.d/0000.yaml"
    text = re.sub(r"set_point: 5\b", f"set_point: {start}", loop.read_text(encoding="utf-8"))
    text = re.sub(r"model: \S*}", f"model: {settle}/plant.yaml}}", text.replace("plant1}", f"plant1, twin: {settle}/model.yaml}}"))
    loop.write_text(text, encoding="utf-8")
    time.sleep(1.1)  # the plan must not be older than the loop's file
    stamp = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
    (evidence / "next_test.yaml").write_text(re.sub(r"(?m)^planned_at: .*", f'planned_at: "{stamp}"', plan), encoding="utf-8")
    return box


def loop_of(box):
    return box.ask({"request": "loop", "loop": TAG})


def at_rest(box, browser, sp):
    browser.until(lambda: (now := loop_of(box))["mode"] == "AUTO" and now["commissioning"] is None and abs(now["set_point_wanted"] - sp) < 1e-9,
                  f"the loop is not as before: {loop_of(box)}")


def press(browser, *keys):
    ActionChains(browser.driver).send_keys(*keys).perform()


def both_steps(box, browser, axe=lambda where: None, keep=lambda name: None):
    """Opens both steps and starts the test, without a mouse."""
    browser.until(lambda: browser.all(f"{PART} .hands button"), f"no test is offered: {browser.text(PART)}")
    browser.run(f"document.querySelector('{PART} .hands button').focus()")
    press(browser, Keys.ENTER)
    browser.until(lambda: "What each outcome means" in browser.text("dialog"), "the first step is not shown")
    words = browser.text("dialog")
    for word in (TAG, "In automatic, SP moves by", "Duration", "Expected at most", "Ends at once", "stiction", "undecided"):
        browser.check(word in words, f"the first step does not name {word!r}: {words}")
    axe("first step of a test")
    keep("test-first-step")
    press(browser, Keys.TAB, Keys.TAB, Keys.ENTER)  # from the title over Cancel to Continue
    browser.until(lambda: browser.all("dialog input[name=tag]"), "the second step is not shown")
    browser.check(loop_of(box)["commissioning"] is None, "the test begins before the second step")
    browser.until(lambda: browser.run("document.activeElement?.name") == "tag", "the tag has not the focus")
    axe("second step of a test")
    keep("test-second-step")
    press(browser, "FIC-102", Keys.ENTER)
    browser.until(lambda: "not the tag" in browser.text("dialog .trouble"), "another tag is accepted")
    press(browser, *[Keys.BACKSPACE] * len("FIC-102"), TAG, Keys.ENTER)
    browser.until(lambda: not browser.all("dialog"), f"the test is refused: {browser.text('dialog')}")
    browser.until(lambda: "Test by ella" in browser.text(f"{PART} .test-now"), f"no progress: {browser.text(PART)}")


def only_for_engineers(box, browser):
    browser.log_in(box, "otto")
    browser.go(box, f"loop/{TAG}")
    browser.until(lambda: "log in as an engineer" in browser.text(PART), f"an operator does not see who may test: {browser.text(PART)}")
    browser.check(not browser.all(f"{PART} .hands button"), "an operator is offered the test")
    browser.log_out()


def dies_with_the_page(box, browser, sp):
    """Kills the page during a test: the daemon restores the loop after 60 s."""
    box.page.kill()
    box.page.wait()
    browser.until(lambda: loop_of(box)["commissioning"] is None, "the loop is not released", 90)
    at_rest(box, browser, sp)
    reason = box.ask({"request": "journal", "kind": "test"})["lines"][0]["reason"]
    browser.check(reason in ("no sign of life for 60 s", "its time is over"), f"the journal says {reason!r}")


def tried(wrong, axe, source, keep, folder):
    with tempfile.TemporaryDirectory() as profile, box_with_a_test() as box, Browser(profile, wrong) as browser:
        browser.screen(1440, 900)
        time.sleep(25)
        sp = loop_of(box)["set_point_wanted"]
        only_for_engineers(box, browser)
        browser.log_in(box, "ella")
        browser.go(box, f"loop/{TAG}")
        both_steps(box, browser, lambda where: axe(browser, where, source), lambda name: keep(browser, folder, name))
        axe(browser, "a test under way", source)
        keep(browser, folder, "test-under-way", full=True)
        browser.press(f"{PART} > button")
        browser.until(lambda: "stopped by ella" in browser.text(PART), f"the test is not stopped: {browser.text(PART)}")
        browser.until(lambda: "as before" in browser.text(PART), f"not restored: {browser.text(PART)}")
        at_rest(box, browser, sp)
        time.sleep(15)
        browser.screen(390, 844)
        both_steps(box, browser, lambda where: axe(browser, f"{where}, 390", source), lambda name: keep(browser, folder, f"{name}-390"))
        browser.check(browser.run("document.documentElement.scrollWidth") <= 390, "the test is wider than a phone")
        browser.until(lambda: "The test decides" in browser.text(PART) or "does not decide" in browser.text(PART), f"no decision: {browser.text(PART)}", 240)
        keep(browser, folder, "test-decided-390", full=True)
        at_rest(box, browser, sp)
        lines = box.ask({"request": "journal", "kind": "test"})["lines"]
        browser.check(lines[0]["what"] == "test result" and "ella" in lines[0]["peer"], f"the journal has {lines[0]}")
        browser.check({"as planned", "stopped by ella"} <= {line["reason"] for line in lines}, f"the journal has {lines}")
        both_steps(box, browser)
        dies_with_the_page(box, browser, sp)
        browser.quiet("test", allowed=("getImageData", "status of 401", "status of 409", "ERR_"))
