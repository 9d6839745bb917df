import { el } from "./dom";
import type { Store } from "./store";

const KEY = "demslam-theme";

/** What the reader chose on this page before, else what the system prefers. */
export function prefersDark(): boolean {
  try {
    const chosen = localStorage.getItem(KEY);
    if (chosen) return chosen === "dark";
  } catch {
    // a page opened from a file may have no storage
  }
  return matchMedia("(prefers-color-scheme: dark)").matches;
}

export function applyTheme(dark: boolean): void {
  document.documentElement.dataset["theme"] = dark ? "dark" : "light";
}

export function themeButton(store: Store): HTMLElement {
  const label = () => (store.state.dark ? "Light" : "Dark");
  const button = el("button", { type: "button", id: "theme", class: "quiet" }, label());
  button.addEventListener("click", () => {
    const dark = !store.state.dark;
    applyTheme(dark); // first, since what is drawn reads its colours from the document
    store.set({ dark });
    button.textContent = label();
    try {
      localStorage.setItem(KEY, dark ? "dark" : "light");
    } catch {
      // not kept, then
    }
  });
  return button;
}
