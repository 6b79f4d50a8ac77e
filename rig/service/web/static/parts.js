// The parts of the page: one is shown at a time, named by the address, so that back and reload keep it.
import { by } from "./dom.js";

const PARTS = ["rig", "runs", "records", "diagnosis", "bringup"];

export function wire() {
  window.addEventListener("hashchange", choose);
  choose();
}

function choose() {
  const wanted = location.hash.slice(1);
  const chosen = PARTS.includes(wanted) && by(wanted) ? wanted : "rig";
  for (const part of PARTS) {
    if (by(part)) by(part).hidden = part !== chosen;
    const link = document.querySelector(`nav a[href="#${part}"]`);
    if (part === chosen) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  document.dispatchEvent(new CustomEvent("part", { detail: chosen }));
}
