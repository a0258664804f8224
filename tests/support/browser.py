"""Control a real Chromium without a screen and without a network, for tests of the report."""

import base64
import shutil
from pathlib import Path

import pytest

from support.marks import missing_program, needs

AXE = Path(__file__).parents[1] / "vendor" / "axe-core" / "axe.min.js"
PHONE, DESKTOP = 360, 1280
# Width of A4 between Chromium's margins, in CSS pixels.
PAPER = 718
SWITCHES = ["headless=new", "no-sandbox", "disable-gpu", "no-first-run", "hide-scrollbars"]
SWITCHES += ["disable-background-networking", "disable-component-update", "disable-sync"]
# The recordings in the report that is opened, and what stands in the header of one.
SIZES = (0, 1, 2.5, 6)
RECORDINGS = [f"{size}mm/r{run:02d}" for size in SIZES for run in (1, 2, 3)] + ["unlabelled/u1"]
EVIL = "<script>document.title='broken'</script><img src=x onerror=\"document.title='broken'\">"
# What is missing for the browser; empty if nothing is. And the mark of tests that need the browser.
MISSING = missing_program("chromium", "chromedriver", packages="chromium chromium-driver")
needed = needs(MISSING)


class Browser:
    """Chromium with one page; an empty folder takes its files."""

    def __init__(self, profile):
        selenium = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
        options = selenium.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        for switch in SWITCHES:
            options.add_argument(f"--{switch}")
        options.add_argument(f"--user-data-dir={profile}")
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        service = selenium.ChromeService(shutil.which("chromedriver"))
        self.driver = selenium.Chrome(options=options, service=service)
        self._command("Network.enable")
        self._let(offline=True)

    def open(self, page, fragment="", *, width=DESKTOP, dark=False):
        """Open a page from disk at a width, light or dark."""
        self._resize(width)
        self.prefer(dark=dark)
        self.driver.get("about:blank")
        self.driver.get_log("browser")
        self.driver.get(page.as_uri() + fragment)
        self.wait_for_drawing()

    def visit(self, address):
        """Open a page that a server on this computer sends."""
        self._let(offline=False)
        self._resize(DESKTOP)
        self.driver.get(address)

    def wait_until(self, condition):
        """Wait until JavaScript that returns a value, or a function, returns a true one."""
        wait = pytest.importorskip("selenium.webdriver.support.wait")
        holds = condition if callable(condition) else lambda: self.run(condition)
        wait.WebDriverWait(self.driver, 20, 0.05).until(lambda _: holds())

    def wait_for_drawing(self):
        """Wait until the page has unpacked and drawn the chosen recording."""
        self.run(
            "return new Promise((done) => { const wait = () =>"
            " document.querySelector('[aria-busy]') ? setTimeout(wait, 5) : done(); wait(); })"
        )

    def prefer(self, *, dark, on_paper=False):
        """Set the theme, as in the settings of the system, and the medium: screen or paper."""
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        media = "print" if on_paper else ""
        self._command("Emulation.setEmulatedMedia", media=media, features=scheme)

    def lay_on_paper(self, *, dark=False):
        """Show the open page as for printing, after the event that a browser sends before it."""
        self.run("window.dispatchEvent(new Event('beforeprint'))")
        self._resize(PAPER)
        self.prefer(dark=dark, on_paper=True)

    def save_into(self, folder):
        """Save what the page offers in a folder, without a question."""
        self._command("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))

    def wait_until_there(self, path):
        """Wait until a file is saved; before it is whole, an empty one can have its name."""
        self.wait_until(lambda: path.exists() and path.stat().st_size)

    def run(self, script, *arguments):
        """Run JavaScript in the page, and return its result."""
        return self.driver.execute_script(script, *arguments)

    def messages(self):
        """Return the messages of the console since the page was opened."""
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def find(self, selector):
        """Return the first element that a CSS selector finds."""
        return self.driver.find_element("css selector", selector)

    def texts(self, selector):
        """Return the text of every visible element that a CSS selector finds."""
        return self.run(
            "return [...document.querySelectorAll(arguments[0])]"
            ".filter((e) => e.offsetParent !== null).map((e) => e.textContent.trim())",
            selector,
        )

    def violations(self):
        """Return the accessibility faults that axe-core finds, each with what has it."""
        self.run(AXE.read_text(encoding="utf-8"))
        found = self.run("return axe.run({ resultTypes: ['violations'] })")["violations"]
        return [(fault["help"], [node["target"] for node in fault["nodes"]]) for fault in found]

    def wait_for_frame(self):
        """Wait until the browser is about to draw the page again."""
        self.run("return new Promise((done) => requestAnimationFrame(() => done()))")

    def picture_at_rest(self):
        """Return a picture of the whole page as PNG, once two pictures in a row are the same."""
        # The browser prepares images beside the page.
        self.run("return Promise.all([...document.images].map((image) => image.decode()))")
        clip = self.run(
            "const { clientWidth, scrollHeight } = document.documentElement;"
            "return { x: 0, y: 0, width: clientWidth, height: scrollHeight, scale: 1 }"
        )
        before = None
        for _ in range(10):
            self.wait_for_frame()
            shot = self._command("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)
            if before == (before := base64.b64decode(shot["data"])):
                return before
        raise AssertionError("the page does not come to rest")

    def close(self):
        """End the browser."""
        self.driver.quit()

    def _let(self, *, offline):
        speed = dict.fromkeys(("downloadThroughput", "uploadThroughput"), -1)
        self._command("Network.emulateNetworkConditions", offline=offline, latency=0, **speed)

    def _resize(self, width):
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
        self._command("Emulation.setDeviceMetricsOverride", **size)

    def _command(self, name, **parameters):
        return self.driver.execute_cdp_cmd(name, parameters)
