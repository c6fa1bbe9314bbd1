"use strict";
document.documentElement.classList.add("js");
// Tooltips: one box for the page, kept inside the window, shown for pointer and keyboard alike.
(() => {
  const box = document.createElement("div");
  box.id = "tip"; box.role = "tooltip"; box.hidden = true;
  document.body.append(box);
  let shownFor = null;
  const show = (term) => {
    shownFor = term;
    box.textContent = term.dataset.tip; box.hidden = false;
    term.setAttribute("aria-describedby", "tip");
    const at = term.getBoundingClientRect(), size = box.getBoundingClientRect(), edge = 8;
    box.style.left = Math.max(edge, Math.min(at.left, document.documentElement.clientWidth - size.width - edge)) + "px";
    box.style.top = (at.bottom + size.height + edge < innerHeight ? at.bottom + 4 : Math.max(edge, at.top - size.height - 4)) + "px";
  };
  const hide = () => { box.hidden = true; shownFor = null; };
  for (const term of document.querySelectorAll("[data-tip]")) {
    term.addEventListener("pointerenter", () => show(term));
    term.addEventListener("focus", () => show(term));
    term.addEventListener("pointerleave", hide);
    term.addEventListener("blur", hide);
  }
  addEventListener("scroll", () => { if (shownFor) show(shownFor); }, { passive: true });
  addEventListener("keydown", (event) => { if (event.key === "Escape") hide(); });
})();
// Number with so many significant digits, decimal sign of the page, true minus.
const shown = (value, digits, decimal) =>
  String(Number(value.toPrecision(digits))).replace("-", "\u2212").replace(".", decimal);
// Value and standard deviation by the rounding rule of the Particle Data Group, as everywhere in the report.
const rounded = (value, std, decimal) => {
  if (!(std > 0)) return shown(value, 4, decimal);
  const power = Math.floor(Math.log10(std)), lead = Math.round(std / 10 ** power * 100);
  const places = Math.max(0, (lead <= 354 ? 1 : 0) - power);
  return [value, std].map((v) => v.toFixed(places).replace("-", "\u2212").replace(".", decimal)).join(" \u00b1 ");
};
