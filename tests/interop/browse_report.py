"""Checks pages in headless Chromium: no console error, no network request, no sideways scrolling, working controls.

python browse_report.py CHROMIUM PAGE...   prints one JSON object per page; exit code 1 if something is wrong, 3 without Playwright.
With SKIAGRAPH_SCREENSHOTS=DIR it saves screenshots of every page.
"""
import json
import os
import pathlib
import sys
import time

try:
    from playwright.sync_api import sync_playwright
except ImportError:
    sys.exit(3)

WIDTHS = {"broad": (1280, 900), "phone": (390, 844)}


def too_wide(page):
    """The elements that reach beyond the window, if the page scrolls sideways."""
    return page.evaluate(
        """() => {
        const width = document.documentElement.clientWidth;
        if (document.documentElement.scrollWidth <= width) return [];
        const wide = [...document.querySelectorAll("body *")].filter((e) => e.getBoundingClientRect().right > width + 1);
        return [`the page is ${document.documentElement.scrollWidth} px wide`, ...wide.slice(0, 5).map((e) => e.tagName + "." + e.className)];
    }"""
    )


def cursors(page):
    return page.eval_on_selector_all(".timeline .cursor", "lines => lines.map(line => Number(line.getAttribute('x1')))")


def pictures(page):
    return page.eval_on_selector_all(".views canvas", "all => all.map(canvas => canvas.toDataURL())")


def check_playback(page, wrong):
    """The slider, keys, buttons, dragging a picture and clicking a plot all move the pictures, the readout and the plots' cursors."""
    slider = page.locator('[data-is="slider"]')
    if slider.count() == 0:
        return {}
    last = int(slider.get_attribute("max"))
    frame = lambda: int(slider.input_value())
    readout = lambda: page.locator('[data-is="readout"]').text_content()

    def moved(what, act, expected):
        before = (frame(), pictures(page), cursors(page), readout())
        act()
        page.wait_for_timeout(120)
        after = (frame(), pictures(page), cursors(page), readout())
        if not expected(after[0]):
            wrong.append(f"{what}: moves from frame {before[0]} to {after[0]}")
        plots = bool(before[2]) and after[2] == before[2]
        if after[0] != before[0] and (plots or after[3] == before[3] or after[1] == before[1]):
            wrong.append(f"{what}: pictures, plots and readout do not change together")

    slider.focus()
    moved("Home", lambda: page.keyboard.press("Home"), lambda f: f == 0)
    moved("arrow key", lambda: page.keyboard.press("ArrowRight"), lambda f: f == 1)
    moved("End", lambda: page.keyboard.press("End"), lambda f: f == last)
    moved("previous", lambda: page.click('[data-is="back"]'), lambda f: f == last - 1)
    moved("next", lambda: page.click('[data-is="on"]'), lambda f: f == last)
    if page.locator("#error svg:visible").count():
        plot = page.locator("#error svg:visible").first
        plot.scroll_into_view_if_needed()
        box = plot.bounding_box()
        moved("click on a plot", lambda: plot.click(position={"x": box["width"] * 0.5, "y": box["height"] * 0.6}), lambda f: 0 < f < last)
    canvas = page.locator(".views canvas").first
    canvas.scroll_into_view_if_needed()
    place = canvas.bounding_box()
    middle = (place["x"] + place["width"] / 2, place["y"] + place["height"] / 2)

    def drag():
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + place["width"] * 0.6, middle[1], steps=4)
        page.mouse.up()

    slider.fill("0")
    page.wait_for_timeout(120)
    moved("drag on a picture", drag, lambda f: f > 0)
    # playing stops at the last frame
    slider.fill(str(max(0, last - 2)))
    page.wait_for_timeout(120)
    page.click('[data-is="play"]')
    page.wait_for_timeout(900)
    if frame() != last:
        wrong.append(f"play: stopped at frame {frame()} of {last}")
    shown = pictures(page)
    if page.locator('[data-is="skeletons"]').is_enabled():
        page.uncheck('[data-is="skeletons"]')
        if pictures(page) == shown:
            wrong.append("skeletons cannot be hidden")
        page.check('[data-is="skeletons"]')
    labels = page.eval_on_selector_all(".views canvas", "all => all.map(canvas => canvas.getAttribute('aria-label'))")
    scored = page.evaluate("JSON.parse(document.getElementById('playback-data').textContent).scored")
    if scored and not all("overlap" in label and "error" in label for label in labels):
        wrong.append(f"labels without scores: {labels[:1]}")
    return {"frames": last + 1, "views": len(labels), "plots": len(cursors(page))}


def check_contents_and_sorting(page, wrong):
    """The contents lead to their headings; clicks on a column's header sort ascending, descending and as before."""
    links = page.locator("nav.contents a")
    if page.locator("main h2:visible").count() >= 3 and links.count() < 3:
        wrong.append("no table of contents")
    for link in links.all():
        target = link.get_attribute("href")[1:]
        if page.evaluate("id => !document.getElementById(id)", target):
            wrong.append(f"contents: there is no element {target}")
    table = page.locator("main table:has(th .sort):visible").first
    if table.count() == 0:
        return
    button = table.locator("th .sort").last
    column = button.evaluate("button => button.closest('th').cellIndex")
    cells = lambda: table.evaluate("(table, column) => [...table.tBodies[0].rows].map(row => row.cells[column].innerText.trim())", column)
    before = cells()
    orders = []
    for _ in range(3):
        button.click()
        orders.append(cells())
    number = lambda text: float(text.replace("▼", "").strip().split(" ")[0].replace("<", ""))
    try:
        up = [number(text) for text in orders[0] if text not in ("", "-", "–")]
        if up != sorted(up):
            wrong.append(f"not sorted: {orders[0]}")
    except ValueError:
        pass
    if sorted(orders[0]) != sorted(before) or orders[2] != before:
        wrong.append(f"sorting loses rows or their order: {before} {orders}")


def check_labels(page, wrong):
    bad = page.evaluate(
        """() => [...document.querySelectorAll("img, svg, canvas, button, input")].filter((e) =>
            !e.closest("[hidden]") && e.getAttribute("aria-hidden") !== "true" &&
            !(e.getAttribute("aria-label") || e.getAttribute("alt") || e.textContent.trim() || e.querySelector("img[alt]") || (e.labels && e.labels.length))
        ).map((e) => e.outerHTML.slice(0, 80))"""
    )
    wrong.extend(f"no label: {element}" for element in bad[:5])


def look(browser, path, shots):
    found = {"page": path.name, "bytes": path.stat().st_size, "wrong": []}
    wrong = found["wrong"]
    for name, (width, height) in WIDTHS.items():
        context = browser.new_context(viewport={"width": width, "height": height}, has_touch=name == "phone")
        page = context.new_page()
        page.on("console", lambda message: message.type in ("error", "warning") and wrong.append(f"console: {message.text}"))
        page.on("pageerror", lambda error: wrong.append(f"script: {error}"))
        page.on("request", lambda request: request.url.startswith(("file:", "data:", "blob:")) or wrong.append(f"network: {request.url}"))
        begin = time.monotonic()
        page.goto(path.as_uri(), wait_until="load")
        page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        found[f"seconds_{name}"] = round(time.monotonic() - begin, 3)
        wrong.extend(f"{name}: sideways scrolling: {element}" for element in too_wide(page))
        check_labels(page, wrong)
        if name == "broad":
            check_contents_and_sorting(page, wrong)
        found[f"playback_{name}"] = check_playback(page, wrong)
        for fold in page.locator("details > summary:visible").all()[:40]:
            fold.click()
        wrong.extend(f"{name}, unfolded: sideways scrolling: {element}" for element in too_wide(page))
        if shots:
            for scheme in ("light", "dark"):
                page.emulate_media(color_scheme=scheme)
                page.screenshot(path=f"{shots}/{path.parent.name}-{path.stem}-{name}-{scheme}.png", full_page=True)
        context.close()
    return found


def main():
    chromium, pages = sys.argv[1], [pathlib.Path(page).resolve() for page in sys.argv[2:]]
    shots = os.environ.get("SKIAGRAPH_SCREENSHOTS")
    if shots:
        pathlib.Path(shots).mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        found = [look(browser, page, shots) for page in pages]
        browser.close()
    for page in found:
        print(json.dumps(page))
    sys.exit(1 if any(page["wrong"] for page in found) else 0)


if __name__ == "__main__":
    main()
