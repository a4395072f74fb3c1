"""Renders pages of `probebox report` in Chromium, in both colour schemes, on a wide and a narrow screen and on A4.

Usage: render_pages.py PROBEBOX CASES. Exit status 77, with the reason, where chromium is not installed.
"""
import html
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# Method, and how many pages of A4 it may take.
METHODS = {"delay-known-sphere": 3, "centreline": 2, "rotary-axis-errors": 3, "screw-calibration": 2,
           "swivel-error": 3, "tool-assembly": 2, "periodic-check": 2}
SCHEMES = {"light": "1", "dark": "0"}
WIDTHS = (1100, 520)
SCRIPT = (pathlib.Path(__file__).parent / "measure.js").read_text()


def chromium(browser, home, *options):
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
               "--user-data-dir=" + str(home / "profile"), *options]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=120).stdout


def measured(browser, home, page, scheme, width):
    dom = chromium(browser, home, "--blink-settings=preferredColorScheme=" + SCHEMES[scheme],
                   f"--window-size={width},1200", "--dump-dom", page.as_uri())
    title = html.unescape(re.search(r"<title>(.*?)</title>", dom, re.S).group(1))
    return json.loads(title)


def spoilt(page):
    """A page with grey words, a table wider than its place and pictures whose words are cut."""
    return page.replace("--soft: #484848", "--soft: #c8c8c8").replace("<h2>Values</h2>", "<h2>Values" + "_" * 400 + "</h2>") \
        .replace('font-size="13"', 'font-size="40"')


def overlooked(browser, home, page):
    """What a look at a spoilt page does not find, though it is there."""
    script = home / "spoilt.html"
    script.write_text(spoilt(page.read_text()).replace("</body>", f"<script>{SCRIPT}</script></body>"))
    wrong = " ".join(measured(browser, home, script, "light", max(WIDTHS))["wrong"])
    return [f"not found on a spoilt page: {one}" for one in ("contrast", "wider than", "text is cut") if one not in wrong]


def objections(browser, home, method, page, most_pages):
    script = home / "measured.html"
    script.write_text(page.read_text().replace("</body>", f"<script>{SCRIPT}</script></body>"))
    for scheme in SCHEMES:
        for width in WIDTHS:
            seen = measured(browser, home, script, scheme, width)
            where = f"{method}, {scheme}, {width} px wide"
            if seen["scheme"] != scheme:
                yield f"{where}: the page is {seen['scheme']}"
            if width == max(WIDTHS) and seen["rows"] > (seen["pictures"] + 1) // 2:
                yield f"{where}: {seen['pictures']} pictures in {seen['rows']} rows"
            yield from (f"{where}: {one}" for one in seen["wrong"])
    paper = home / "paper.pdf"
    chromium(browser, home, "--no-pdf-header-footer", f"--print-to-pdf={paper}", page.as_uri())
    pages = len(re.findall(rb"/Type\s*/Page\b", paper.read_bytes()))
    if not 1 <= pages <= most_pages:
        yield f"{method}: {pages} pages of A4, not {most_pages} at most"


def main(probebox, cases):
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        print("Skipped: chromium is not installed, so nobody looks at the pages (apt-get install chromium)")
        return 77
    found = []
    with tempfile.TemporaryDirectory(prefix="probebox-pages-") as folder:
        home = pathlib.Path(folder)
        for method, most_pages in METHODS.items():
            page = home / (method + ".html")
            subprocess.run([probebox, "report", str(pathlib.Path(cases) / method), "-o", str(page)], check=True,
                           stdout=subprocess.DEVNULL)
            found += objections(browser, home, method, page, most_pages)
        found += overlooked(browser, home, page)
    for one in found:
        print(one)
    print(f"{len(METHODS)} pages rendered, {len(found)} objections")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
