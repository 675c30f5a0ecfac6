"""How soon a report is on screen: first_view.py REPORT.html [N]

Prints the best and the median of N times (7) until the first picture is drawn, and until all is.
"""

import os
import statistics
import sys

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "browser"))
import chromium  # noqa: E402


def main():
    page = sys.argv[1]
    times = {"first view": [], "complete": []}
    with chromium.Chromium() as browser:
        browser.window(1366, 820)
        for _ in range(int(sys.argv[2]) if len(sys.argv) > 2 else 7):
            browser.open(page)
            for mark in ("unflex-complete", "first-contentful-paint"):
                browser.wait_for(f"performance.getEntriesByName('{mark}').length > 0")
            paint, first, complete = browser.run(
                "[performance.getEntriesByName('first-contentful-paint')[0].startTime,"
                "performance.getEntriesByName('unflex-first-view')[0].startTime,"
                "performance.getEntriesByName('unflex-complete')[0].startTime]")
            times["first view"].append(max(paint, first))
            times["complete"].append(complete)
    print(f"{os.path.getsize(page) / 1e6:.2f} MB")
    for name, each in times.items():
        print(f"{name}: best {min(each):.0f} ms, median {statistics.median(each):.0f} ms")


if __name__ == "__main__":
    main()
