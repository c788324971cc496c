# SPDX-License-Identifier: Apache-2.0
"""A browser for tests of pages."""
import base64
import json
import sys
import time

try:
    from selenium import webdriver
    from selenium.common.exceptions import WebDriverException
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import WebDriverWait
except ImportError:
    sys.exit("python3-selenium is missing: tools/install-packages test")


class Chromium:
    """Debian's chromium, headless. `wrong` collects the faults found."""

    def __init__(self, profile, wrong):
        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars", "--disable-renderer-backgrounding",
                     "--disable-backgrounding-occluded-windows", f"--user-data-dir={profile}"):
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        self.driver.set_script_timeout(300)  # time-out for axe-core on a slow machine
        self.wrong = wrong

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.driver.quit()

    def screen(self, width=1400, height=900, scheme="dark", scale=1):
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": width < 600})
        self.media("", scheme)

    def media(self, media, scheme="dark"):
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media, "features": [
            {"name": "prefers-color-scheme", "value": scheme}, {"name": "prefers-reduced-motion", "value": "reduce"}]})

    def run(self, script, *arguments):
        return self.driver.execute_script("return " + script, *arguments)

    def run_async(self, script, *arguments):
        """`script` is the body of an async function of the arguments a, b, c."""
        return self.driver.execute_async_script(
            "const done = arguments[arguments.length - 1], given = [...arguments].slice(0, -1);"
            f"(async (a, b, c) => {{ {script} }})(...given).then(done, (e) => done(String(e)));", *arguments)

    def find(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector):
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def text(self, selector="body"):
        return self.run("document.querySelector(arguments[0])?.innerText ?? ''", selector).replace("\u00a0", " ").replace("\u2009", " ")

    def check(self, right, what):
        if not right:
            self.wrong.append(what)
            print(f"WRONG: {what}", file=sys.stderr)
        return right

    def until(self, condition, what, limit=60):
        """Waits until the condition is true. The limit only ends a failing test. Returns the
        seconds it took, or None."""
        begin = time.monotonic()
        try:
            WebDriverWait(self.driver, limit, 0.03, ignored_exceptions=(WebDriverException,)).until(lambda _: condition())
            return time.monotonic() - begin
        except WebDriverException:
            self.check(False, what)
            return None

    def press(self, selector):
        self.until(lambda: self.run("(() => { const e = document.querySelector(arguments[0]); if (!e || e.disabled) return false; e.scrollIntoView({block: 'center'}); e.click(); return true; })()".replace("arguments[0]", json.dumps(selector))),
                   f"{selector} can't be pressed")

    def shot(self, path, full=False):
        clip = {}
        if full:
            size = self.driver.execute_cdp_cmd("Page.getLayoutMetrics", {})["cssContentSize"]
            clip = {"captureBeyondViewport": True, "clip": {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}}
        path.write_bytes(base64.b64decode(self.driver.execute_cdp_cmd("Page.captureScreenshot", clip)["data"]))

    def pdf(self):
        return base64.b64decode(self.driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})["data"])

    def quiet(self, where, allowed=()):
        for entry in self.driver.get_log("browser"):
            # Excludes the browser's own pages.
            if not entry["message"].startswith("chrome://") and not any(word in entry["message"] for word in allowed):
                self.check(False, f"{where}: console: {entry['message']}")
