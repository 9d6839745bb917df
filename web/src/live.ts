import type { PageData } from "./data";
import { el } from "./dom";

/** Calls `update` with every state of a running `demslam run --live`, until it ends. */
export function listen(address: string, update: (data: PageData) => void): void {
  const sign = el("div", { class: "live", role: "status" }, "live");
  document.querySelector("header.top")?.append(sign);
  const source = new EventSource(address);
  source.addEventListener("state", (event) => update(JSON.parse((event as MessageEvent<string>).data) as PageData));
  source.addEventListener("end", () => {
    source.close();
    sign.textContent = "finished";
  });
  source.addEventListener("error", () => (sign.textContent = "run is out of reach"));
  source.addEventListener("open", () => (sign.textContent = "live"));
}
