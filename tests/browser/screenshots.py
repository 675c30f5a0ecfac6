"""Pictures of a report for the documentation: screenshots.py REPORT.html FOLDER

Writes report_light.png, report_dark.png (where a worst place was chosen) and report_phone.png.
"""

import os
import sys

import chromium


def main():
    page, folder = sys.argv[1:3]
    with chromium.Chromium() as browser:
        for name, width, height, phone, dark in (("light", 1280, 880, False, False),
                                                 ("dark", 1280, 880, False, True),
                                                 ("phone", 390, 780, True, False)):
            browser.window(width, height, phone=phone, dark=dark)
            browser.open(page)
            browser.wait_for("performance.getEntriesByName('unflex-complete').length > 0")
            if dark:
                browser.run("document.querySelector('#worst-before button').click();"
                            "document.getElementById('moment').scrollIntoView()")
            browser.run("new Promise(done => setTimeout(done, 300))")
            browser.screenshot(os.path.join(folder, f"report_{name}.png"))


if __name__ == "__main__":
    main()
