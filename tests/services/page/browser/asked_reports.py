# SPDX-License-Identifier: Apache-2.0
"""Reports that are asked for on a loop's page: by an engineer, seen by everybody."""

POST = """const {csrf} = await (await fetch('/api/session')).json();
  return (await fetch(a, {method: 'POST', body: JSON.stringify(b), headers: {'Content-Type': 'application/json', 'X-CSRF-Token': csrf}})).status;"""
ROWS = ".asked-reports tbody tr"


def asked(box, browser, tag):
    """By an operator it is neither offered nor taken; an engineer's is made of what the trend shows, and opens in its sandbox."""
    path = f"/api/loops/{tag}/reports"
    browser.go(box, f"loop/{tag}")
    browser.until(lambda: "log in as an engineer" in browser.text(".asked-reports"), "an operator is not told who may ask")
    browser.check(not browser.all(".asked-reports form"), "an operator is offered to ask for a report")
    status = browser.run_async(POST, path, {"kind": "gap", "from_ms": 1, "to_ms": 2})
    browser.check(status == 403, f"an operator's wish for a report gets {status}")

    browser.log_out()
    browser.log_in(box, "ella")
    browser.go(box, f"loop/{tag}")
    browser.until(lambda: browser.all(".asked-reports form") and all(one.get_attribute("value") for one in browser.all(".asked-reports input")),
                  "the times are not those of the trend")
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
