"""The pages of `nacre view` in headless Chromium, clicked at: dataset, material, preset, session.

browser_test.py NACRE CHROMEDRIVER SOURCE"""

import json
import os
import subprocess
import sys
import tempfile
import time

from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By

NACRE, DRIVER, SOURCE = sys.argv[1:4]
PHANTOM = """
[slab]
thickness_mm = 10.0
eta = 1.4
[[medium]]
name = "pale"
sigma_a_per_mm = [0.002, 0.004, 0.007]
sigma_s_per_mm = [2.2, 2.6, 3.0]
[[medium]]
name = "dark"
sigma_a_per_mm = [0.06, 0.08, 0.09]
sigma_s_per_mm = [1.0, 1.1, 1.2]
[pattern]
type = "chessboard"
cell_mm = 4.0
[grid]
points = [14, 12]
pitch_mm = 1.0
core = 9
"""


def check(condition, text):
    if not condition:
        raise AssertionError(text)
    print("ok: " + text)


def run(*arguments):
    subprocess.run([NACRE, *arguments, "--quiet"], check=True, stdout=subprocess.DEVNULL)


class Page:
    """A `nacre view` that runs, shown in the browser."""

    def __init__(self, browser, *arguments):
        self.browser = browser
        self.process = subprocess.Popen(
            [NACRE, "view", *arguments, "--json", "--quiet"], stdout=subprocess.PIPE, text=True)
        self.url = json.loads(self.process.stdout.readline())["url"]

    def __enter__(self):
        self.browser.get(self.url)
        self.wait(lambda: self.text("title") != "Nacre", "a title")
        return self

    def __exit__(self, *_):
        self.process.terminate()
        check(self.process.wait(10) in (0, 75), "it ends when told to")

    def wait(self, condition, what):
        def holds():
            try:
                return condition()
            except StaleElementReferenceException:  # drawn anew between finding and asking
                return False

        end = time.time() + 20
        while not holds():
            if time.time() > end:
                raise AssertionError("no %s; the page says '%s'" % (what, self.text("error")))
            time.sleep(0.05)
        print("ok: " + what)

    def at(self, name):
        return self.browser.find_element(By.ID, name)

    def text(self, name):
        return self.at(name).text

    def click(self, name, x=0.5, y=0.5, press=True):
        """At a share of an element's width and height, from the upper left."""
        element = self.at(name)
        size = element.size
        actions = ActionChains(self.browser).move_to_element_with_offset(
            element, round((x - 0.5) * size["width"]), round((y - 0.5) * size["height"]))
        (actions.click() if press else actions).perform()

    def slide(self, name, value):
        self.browser.execute_script(
            "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input'))",
            self.at(name), value)

    def pixels(self, name):
        """An image's or a canvas' bytes, RGBA, as drawn."""
        return self.browser.execute_script("""
            const from = document.getElementById(arguments[0]), c = document.createElement('canvas');
            c.width = from.naturalWidth || from.width; c.height = from.naturalHeight || from.height;
            const x = c.getContext('2d'); x.drawImage(from, 0, 0);
            return [c.width, c.height, ...x.getImageData(0, 0, c.width, c.height).data];""", name)

    def light_at(self, x, y):
        """The green of the sample's picture at a share of its sides."""
        width, height, *data = self.pixels("sample")
        return data[4 * (int(y * height) * width + int(x * width)) + 1]


def see_slices(page, grid):
    page.wait(lambda: "(%d, %d)" % (grid[0] // 2, grid[1] // 2) in page.text("where"),
              "the middle's slice comes by itself")
    page.wait(lambda: page.at("sample").get_property("naturalWidth") == grid[0], "the sample")
    page.click("sample", 2.5 / grid[0], 1.5 / grid[1])
    page.wait(lambda: "point (2, 1)" in page.text("where"), "a click shows that point's slice")
    for name in ("slice-R", "slice-G", "slice-B", "residual-R"):
        width, height, *data = page.pixels(name)
        check(width == height and len({tuple(data[k:k + 3]) for k in range(0, len(data), 4)}) > 3,
              name + " is painted")
    curves = page.at("profile").find_elements(By.TAG_NAME, "polyline")
    check(len(curves) >= 3, "a profile a channel")


def see_light(page):
    page.click("mode-light")
    page.click("sample", 0.25, 0.3, press=False)
    page.wait(lambda: page.light_at(0.25, 0.3) > page.light_at(0.8, 0.8) + 40,
              "light where the mouse is")
    page.click("sample", 0.8, 0.8, press=False)
    page.wait(lambda: page.light_at(0.8, 0.8) > page.light_at(0.25, 0.3) + 40,
              "and it goes along")
    before = page.light_at(0.8, 0.8)
    page.slide("ev", -3)
    page.wait(lambda: page.light_at(0.8, 0.8) < before - 30, "less exposure is darker")
    page.click("mode-slice")


def see_all(browser, folder):
    dataset, material = (os.path.join(folder, n) for n in ("x.rd.exr", "x.nacre.exr"))
    phantom = os.path.join(folder, "phantom.toml")
    with open(phantom, "w", encoding="utf-8") as file:
        file.write(PHANTOM)
    run("simulate", phantom, "--out", dataset, "--solver", "diffusion")
    run("factor", dataset, "--method", "log-svd", "--terms", "4", "--out", material)
    with Page(browser, dataset) as page:
        see_slices(page, (14, 12))
        see_light(page)
    with Page(browser, material, "--against", dataset) as page:
        see_slices(page, (14, 12))
        good = float(page.at("residual-G").get_attribute("data-l2"))
        check("relative L2" in page.text("residual-l2"), "the residual in words")
        browser.save_screenshot(os.path.join(folder, "material.png"))
        dot = page.at("curve").find_element(By.TAG_NAME, "circle").get_attribute("cx")
        page.slide("terms", 1)
        page.wait(lambda: float(page.at("residual-G").get_attribute("data-l2")) > 1.5 * good,
                  "one term is worse than four (which miss by %.4f)" % good)
        check("error" in page.text("terms-error"), "and the slider says so")
        moved = page.at("curve").find_element(By.TAG_NAME, "circle").get_attribute("cx")
        check(float(moved) < float(dot), "a dot goes along the curve of errors")
        kernels = page.at("kernels").find_elements(By.TAG_NAME, "img")
        page.wait(lambda: all(k.get_property("naturalWidth") == 9 for k in kernels), "kernels")
        check(len(kernels) == 12, "a kernel a term and channel")
    with Page(browser, os.path.join(SOURCE, "presets", "SVD_S10_Chess4x4")) as page:
        check("Chessboard" in page.text("title"), "a preset's title")
        see_light(page)
        browser.save_screenshot(os.path.join(folder, "view.png"))
    see_session(browser, folder)


def see_session(browser, folder):
    session = os.path.join(folder, "session")
    with open(os.path.join(SOURCE, "rigs", "simulated-stripes.toml"), encoding="utf-8") as file:
        text = file.read()
    for old, new in (("points = [20, 26]", "points = [4, 3]"),
                     ("stripes.toml", os.path.join(SOURCE, "rigs", "stripes.toml"))):
        check(old in text, "the rig has " + old)
        text = text.replace(old, new)
    rig = os.path.join(folder, "rig.toml")
    with open(rig, "w", encoding="utf-8") as file:
        file.write(text)
    run("capture", rig, "--out", session)
    with Page(browser, session) as page:
        first = page.text("picture-name")
        page.wait(lambda: page.at("frame").get_property("naturalWidth") > 50, "a picture")
        page.slide("picture", 3)
        check(page.text("picture-name") != first, "another picture's name")
        page.wait(lambda: "n=3" in page.at("frame").get_attribute("src"), "another picture")


def main():
    options = webdriver.ChromeOptions()
    with tempfile.TemporaryDirectory(prefix="nacre-view-") as folder:
        for argument in ("headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage",
                         "window-size=1500,1200", "user-data-dir=" + folder + "/profile"):
            options.add_argument("--" + argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        browser = webdriver.Chrome(service=Service(DRIVER), options=options)
        try:
            see_all(browser, folder)
            bad = [entry["message"] for entry in browser.get_log("browser")
                   if entry["level"] == "SEVERE"]
            check(not bad, "no errors in the browser's console %s" % bad)
            if "NACRE_SCREENSHOT" in os.environ:
                for name in ("view", "material"):
                    os.replace("%s/%s.png" % (folder, name),
                               "%s-%s.png" % (os.environ["NACRE_SCREENSHOT"], name))
        finally:
            browser.quit()


if __name__ == "__main__":
    main()
