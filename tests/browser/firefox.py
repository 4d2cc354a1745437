"""Firefox driven by its own remote protocol, Marionette, with the methods of `webdriver.Browser`."""

import json
import pathlib
import re
import shutil
import socket
import subprocess
import tempfile
import time

import webdriver

# The names in Marionette of WebDriver's addresses.
COMMANDS = {
    "/url": "WebDriver:Navigate", "/execute/sync": "WebDriver:ExecuteScript", "/execute/async": "WebDriver:ExecuteAsyncScript",
    "/element": "WebDriver:FindElement", "/actions": "WebDriver:PerformActions", "/frame": "WebDriver:SwitchToFrame",
    "/screenshot": "WebDriver:TakeScreenshot",
}
OF_ELEMENT = {"click": "WebDriver:ElementClick", "value": "WebDriver:ElementSendKeys"}


def program():
    return shutil.which("firefox-esr") or shutil.which("firefox")


def missing():
    return None if program() else "`firefox` is not installed"


class Firefox(webdriver.Browser):
    """One session with an empty profile; `with Firefox() as b:`."""

    def __init__(self, width=1280, height=800):
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        pathlib.Path(self.profile.name, "user.js").write_text(
            f'user_pref("marionette.port", {port});\nuser_pref("datareporting.policy.dataSubmissionEnabled", false);\n'
            'user_pref("app.update.enabled", false);\nuser_pref("browser.shell.checkDefaultBrowser", false);\n')
        self.server = subprocess.Popen(
            [program(), "--headless", "--no-remote", "--marionette", "--profile", self.profile.name, f"--width={width}", f"--height={height}"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.count = 0
        for attempt in range(600):
            try:
                self.socket = socket.create_connection(("127.0.0.1", port), timeout=120)
                break
            except OSError:
                time.sleep(0.1)
        else:
            raise RuntimeError("Firefox does not answer")
        self.answer()
        self.command("WebDriver:NewSession", {"capabilities": {"alwaysMatch": {}}})

    def __exit__(self, *_):
        try:
            self.command("Marionette:Quit", {"flags": ["eForceQuit"]})
        except (OSError, RuntimeError):
            self.server.terminate()
        self.server.wait()
        self.socket.close()
        self.profile.cleanup()

    def answer(self):
        """A message: its length, a colon, JSON."""
        length = b""
        while not length.endswith(b":"):
            byte = self.socket.recv(1)
            if not byte:
                raise OSError("Firefox hung up")
            length += byte
        text = b""
        while len(text) < int(length[:-1]):
            text += self.socket.recv(1 << 16)
        return json.loads(text)

    def command(self, name, params):
        self.count += 1
        text = json.dumps([0, self.count, name, params]).encode()
        self.socket.sendall(b"%d:%s" % (len(text), text))
        _, _, error, result = self.answer()
        if error:
            raise RuntimeError(f"{name}: {error}")
        return result.get("value", result) if isinstance(result, dict) else result

    def call(self, method, path, body=None):
        of_element = re.fullmatch("/element/([^/]+)/(click|value)", path)
        if of_element:
            return self.command(OF_ELEMENT[of_element[2]], {"id": of_element[1], **(body or {})})
        return self.command(COMMANDS[path], body or {})

    def log(self, kind):
        """Firefox has no log for drivers."""
        return []
