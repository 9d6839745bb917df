// A headless Chromium, driven through the DevTools protocol over its pipe: nothing to install but Debian's package.
import { spawn } from "node:child_process";
import { accessSync, constants, mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { delimiter, join } from "node:path";

const NAMES = ["chromium-headless-shell", "chromium", "google-chrome"];

/** The path of a browser, or null. */
export function findBrowser() {
  for (const folder of (process.env.PATH ?? "").split(delimiter)) {
    for (const name of NAMES) {
      try {
        accessSync(join(folder, name), constants.X_OK);
        return join(folder, name);
      } catch {
        // not this one
      }
    }
  }
  return null;
}

/** Why tests of the page cannot run here; false where they can. PAGE is the page that was built into demslam. */
export function skipReason({ browser = true } = {}) {
  const { PAGE } = process.env;
  if (PAGE && statSync(PAGE).size === 0) return "demslam was built without its report page: npm could not build it";
  return browser && !findBrowser() ? "no Chromium here: scripts/setup --with-browser installs one" : false;
}

/** Messages to the browser and back: JSON with a zero byte behind each. */
class Pipe {
  #next = 1;
  #waiting = new Map();
  #listeners = [];
  #rest = "";
  constructor(output, input) {
    this.output = output;
    input.setEncoding("utf8");
    input.on("data", (text) => this.#receive(text));
  }
  on(listener) {
    this.#listeners.push(listener);
  }
  send(method, params = {}, sessionId = undefined) {
    const id = this.#next++;
    this.output.write(JSON.stringify({ id, method, params, sessionId }) + "\0");
    return new Promise((resolve, reject) => this.#waiting.set(id, { resolve, reject }));
  }
  #receive(text) {
    const messages = (this.#rest + text).split("\0");
    this.#rest = messages.pop();
    for (const message of messages.map((m) => JSON.parse(m))) {
      const waiting = this.#waiting.get(message.id);
      if (!waiting) for (const listener of this.#listeners) listener(message);
      else if (message.error) waiting.reject(new Error(message.error.message));
      else waiting.resolve(message.result);
      this.#waiting.delete(message.id);
    }
  }
}

export class Browser {
  static async start({ webgl = true } = {}) {
    const profile = mkdtempSync(join(tmpdir(), "demslam-browser-"));
    const gl = webgl ? ["--enable-unsafe-swiftshader"] : ["--disable-3d-apis"];
    const flags = ["--headless", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--mute-audio",
      "--remote-debugging-pipe", `--user-data-dir=${profile}`, ...gl];
    const child = spawn(findBrowser(), flags, { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
    const browser = new Browser();
    Object.assign(browser, { child, profile, pipe: new Pipe(child.stdio[3], child.stdio[4]) });
    return browser;
  }
  async page(options = {}) {
    const { targetId } = await this.pipe.send("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await this.pipe.send("Target.attachToTarget", { targetId, flatten: true });
    const page = new Page(this.pipe, sessionId, targetId);
    await page.prepare(options);
    return page;
  }
  async close() {
    const ended = new Promise((resolve) => this.child.once("exit", resolve));
    this.pipe.send("Browser.close").catch(() => {});
    const killer = setTimeout(() => this.child.kill("SIGKILL"), 60000);
    await ended;
    clearTimeout(killer);
    rmSync(this.profile, { recursive: true, force: true, maxRetries: 5 });
  }
}

export class Page {
  problems = []; // console errors and uncaught exceptions
  constructor(pipe, session, target) {
    Object.assign(this, { pipe, session, target });
    pipe.on((message) => message.sessionId === session && this.#note(message));
  }
  send(method, params) {
    return this.pipe.send(method, params, this.session);
  }
  async prepare({ width = 1440, height = 900, mobile = false, dark = false }) {
    for (const domain of ["Page", "Runtime", "Log"]) await this.send(`${domain}.enable`);
    this.size = { width, height, deviceScaleFactor: mobile ? 2 : 1, mobile };
    await this.send("Emulation.setDeviceMetricsOverride", this.size);
    await this.send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }] });
  }
  async open(url) {
    const loaded = new Promise((resolve) => this.pipe.on((m) => m.sessionId === this.session && m.method === "Page.loadEventFired" && resolve()));
    await this.send("Page.navigate", { url });
    await loaded;
  }
  close() {
    return this.pipe.send("Target.closeTarget", { targetId: this.target });
  }
  async evaluate(expression) {
    const { result, exceptionDetails } = await this.send("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }
  /** Waits for an expression to become true. Throws after five minutes, which only a page that is stuck takes. */
  until(expression) {
    const stuck = JSON.stringify(`never became true: ${expression}`);
    return this.evaluate(`new Promise((done, fail) => {
      const end = performance.now() + 300000;
      const look = () => (${expression} ? done(true) : performance.now() > end ? fail(new Error(${stuck})) : setTimeout(look, 50));
      look();
    })`);
  }
  /** Two displayed frames: what was asked to be drawn has been drawn. */
  settle() {
    return this.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))");
  }
  async click(selector) {
    const at = await this.evaluate(`(() => {
      const element = document.querySelector(${JSON.stringify(selector)});
      element.scrollIntoView({ block: "center" });
      const box = element.getBoundingClientRect();
      return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
    })()`);
    await this.clickAt(at.x, at.y);
  }
  async clickAt(x, y) {
    for (const type of ["mousePressed", "mouseReleased"]) {
      await this.send("Input.dispatchMouseEvent", { type, x, y, button: "left", clickCount: 1 });
    }
    await this.settle();
  }
  async press(key) {
    for (const type of ["keyDown", "keyUp"]) await this.send("Input.dispatchKeyEvent", { type, key, text: type === "keyDown" && key.length === 1 ? key : undefined });
    await this.settle();
  }
  /** Of the window, or of the whole page in a window that is high enough. */
  async screenshot(full = false) {
    if (full) await this.resize({ ...this.size, deviceScaleFactor: 1, height: await this.evaluate("document.documentElement.scrollHeight") });
    const { data } = await this.send("Page.captureScreenshot", { format: "png" });
    if (full) await this.resize(this.size);
    return Buffer.from(data, "base64");
  }
  async resize(size) {
    await this.send("Emulation.setDeviceMetricsOverride", size);
    await this.settle();
    await this.settle();
  }
  #note({ method, params }) {
    if (method === "Runtime.exceptionThrown") this.problems.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === "Runtime.consoleAPICalled" && ["error", "warning", "assert"].includes(params.type)) {
      this.problems.push(params.args.map((a) => a.value ?? a.description).join(" "));
    }
    if (method === "Log.entryAdded" && params.entry.level === "error") this.problems.push(params.entry.text);
  }
}
