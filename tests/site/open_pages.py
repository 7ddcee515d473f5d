"""Opens every page of the built site in headless Chromium, on a desktop and on a phone.

python tests/site/open_pages.py CHROMIUM SITE      exit code 1 if something is wrong, 3 without Playwright

A page must not scroll sideways, report an error, lack a picture or ask another computer for anything, and the search
must find a page. With SKIAGRAPH_SCREENSHOTS=DIR it saves screenshots.
"""

import functools
import http.server
import os
import pathlib
import sys
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop"))
from browse_report import WIDTHS, sync_playwright, too_wide  # noqa: E402

# pictures that could not be read
BROKEN = "() => [...document.images].filter(image => image.complete && !image.naturalWidth).map(image => image.src)"


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def serve(site):
    """Serves a folder on this computer; returns its address."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=site))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}/"


def check_search(page, wrong):
    """The search finds the page about the blindfold; a busy computer needs a while for its index."""
    # key by key: the site listens to keys, and what is filled in at once may come before it reads the field
    page.locator("input.md-search__input").press_sequentially("blindfold")
    try:
        page.locator(".md-search-result__link[href*='blindfold']").first.wait_for(state="attached", timeout=60_000)
    except Exception as error:
        wrong.append(f"search: {error}")


def main():
    chromium, site = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    shots = os.environ.get("SKIAGRAPH_SCREENSHOTS")
    if shots:
        pathlib.Path(shots).mkdir(parents=True, exist_ok=True)
    pages = sorted(path.relative_to(site).as_posix() for path in site.rglob("*.html"))
    wrong, address = [], serve(site)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for size, (width, height) in WIDTHS.items():
            page = browser.new_context(viewport={"width": width, "height": height}).new_page()
            at = [""]
            page.on("console", lambda message: message.type == "error" and wrong.append(f"{at[0]}: {message.text}"))
            page.on("pageerror", lambda error: wrong.append(f"{at[0]}: {error}"))
            page.on(
                "request",
                lambda request: (
                    request.url.startswith((address, "data:", "blob:")) or wrong.append(f"{at[0]}: asks {request.url}")
                ),
            )
            for at[0] in pages:
                page.goto(address + at[0], wait_until="load")
                found = too_wide(page) + page.evaluate(BROKEN)
                wrong += [f"{at[0]}, {size}: {what}" for what in found]
                if shots:
                    page.screenshot(path=f"{shots}/{at[0].replace('/', '-').removesuffix('.html')}-{size}.png")
            if size == "broad":
                page.goto(address + "index.html", wait_until="load")
                check_search(page, wrong)
        browser.close()
    print(*wrong, f"{len(pages)} pages opened", sep="\n")
    sys.exit(1 if wrong or not pages else 0)


if __name__ == "__main__":
    main()
