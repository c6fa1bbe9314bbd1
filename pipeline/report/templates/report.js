// Photos: one at a time, by buttons, list or arrow keys; the centerline can be taken off.
(() => {
  const photos = [...document.querySelectorAll(".photo")];
  const list = document.getElementById("photo-choose"), toggle = document.getElementById("photo-toggle");
  if (!photos.length || !list) return;
  let at = 0;
  const go = (to) => {
    at = (to + photos.length) % photos.length;
    photos.forEach((photo, index) => { photo.hidden = index !== at; });
    list.value = String(at);
  };
  const line = () => document.getElementById("photo-list").classList.toggle("plain", !toggle.checked);
  list.addEventListener("change", () => go(Number(list.value)));
  document.getElementById("photo-previous").addEventListener("click", () => go(at - 1));
  document.getElementById("photo-next").addEventListener("click", () => go(at + 1));
  toggle.addEventListener("change", line);
  document.getElementById("photos").addEventListener("keydown", (event) => {
    if (event.target.matches("select, input:not([type=checkbox])") || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "ArrowLeft") go(at - 1);
    else if (event.key === "ArrowRight") go(at + 1);
    else if (event.key.toLowerCase() === "c") { toggle.checked = !toggle.checked; line(); }
    else return;
    event.preventDefault();
  });
  go(0); line();
  // Marks: clicks on a photo, in its own pixels, as the lines of [[photos]] that correct it in specimen.toml.
  const kind = document.getElementById("mark"), marks = photos.map(() => ({}));
  const least = { use: 1, ends_px: 2, path_px: 2, region_px: 2, exclude_px: 3 }, most = { use: 1, ends_px: 2, region_px: 2 };
  const written = {
    use: () => "false",
    region_px: (points) => JSON.stringify([Math.min, Math.max].flatMap((end) => [0, 1].map((k) => end(...points.map((p) => p[k]))))),
    exclude_px: (points) => JSON.stringify([points]),
  };
  const write = () => {
    const blocks = marks.flatMap((mark, index) => {
      const lines = Object.entries(mark).filter(([key, points]) => points.length >= least[key]).map(([key, points]) => `${key} = ${(written[key] ?? JSON.stringify)(points)}`);
      return lines.length ? [["[[photos]]", `image = ${JSON.stringify(photos[index].dataset.image)}`, ...lines].join("\n")] : [];
    });
    document.getElementById("mark-lines").textContent = blocks.join("\n\n");
    document.getElementById("marked").hidden = !blocks.length;
    photos.forEach((photo, index) => {
      const drawn = photo.querySelector(".picture svg");
      if (!drawn) return;
      drawn.querySelectorAll(".mark").forEach((node) => node.remove());
      for (const [u, v] of Object.values(marks[index]).flat()) {
        const dot = document.createElementNS("http://www.w3.org/2000/svg", "circle"), reduction = Number(drawn.parentNode.dataset.reduction);
        dot.setAttribute("class", "mark"); dot.setAttribute("r", drawn.viewBox.baseVal.width / 200);
        dot.setAttribute("cx", (u + 0.5) / reduction); dot.setAttribute("cy", (v + 0.5) / reduction);
        drawn.append(dot);
      }
    });
  };
  kind.addEventListener("change", () => { delete marks[at][kind.value]; write(); });
  photos.forEach((photo, index) => photo.querySelector(".picture")?.addEventListener("click", (event) => {
    const picture = event.currentTarget, box = picture.getBoundingClientRect(), key = kind.value;
    if (!key) return;
    const pixel = (share, across) => Math.round(10 * (share * across * Number(picture.dataset.reduction) - 0.5)) / 10;
    const { width, height } = picture.querySelector("svg").viewBox.baseVal;
    marks[index][key] = [...(marks[index][key] ?? []), [pixel((event.clientX - box.left) / box.width, width), pixel((event.clientY - box.top) / box.height, height)]].slice(-(most[key] ?? 1e3));
    write();
  }));
})();
// Main figure: curvature, value, band and supporting photos under the pointer or at the arrow keys' cursor.
(() => {
  const source = document.getElementById("pointer-data"), plot = document.getElementById("characteristic");
  if (!source || !plot) return;
  const data = JSON.parse(source.textContent);
  if (!data.ways) return;
  const { frame, decimal } = data, [left, top, right, bottom] = frame.box, out = document.getElementById("readout");
  const first = out.innerHTML, svg = "http://www.w3.org/2000/svg";
  const mark = document.createElementNS(svg, "g"); mark.id = "point"; plot.append(mark);
  const add = (name, values) => {
    const node = document.createElementNS(svg, name);
    for (const key in values) node.setAttribute(key, values[key]);
    mark.append(node);
  };
  const between = (xs, ys, x) => {
    let i = xs.findIndex((v) => v >= x);
    if (i < 0) i = xs.length - 1;
    i = Math.max(1, i);
    const share = (x - xs[i - 1]) / (xs[i] - xs[i - 1]);
    return ys[i - 1] + share * (ys[i] - ys[i - 1]);
  };
  const inside = (way, x) => x >= way.kappa[0] && x <= way.kappa[way.kappa.length - 1];
  let kappa = null;
  const show = (x) => {
    kappa = Math.max(frame.x[0], Math.min(frame.x[1], x));
    mark.replaceChildren();
    const px = left + (kappa - frame.x[0]) / (frame.x[1] - frame.x[0]) * (right - left);
    add("line", { x1: px, x2: px, y1: top, y2: bottom });
    out.replaceChildren();
    const put = (text, bold) => { const node = document.createElement(bold ? "b" : "span"); node.textContent = text; out.append(node); };
    put(`\u03ba = ${shown(kappa, 3, decimal)} 1/m. `, true);
    const ways = data.ways.filter((way) => inside(way, kappa) && !(way.aside && stage.classList.contains("quiet")));
    for (const way of ways) {
      const value = between(way.kappa, way.value, kappa), std = between(way.kappa, way.std, kappa), half = data.half * std;
      const py = bottom - (value - frame.y[0]) / (frame.y[1] - frame.y[0]) * (bottom - top);
      add("circle", { cx: px, cy: py, r: 4, style: `fill:var(--${way.method});stroke:var(--paper)` });
      const places = Math.max(0, (rounded(value, std, ".").split(" ")[0].split(".")[1] || "").length);
      const edge = (v) => v.toFixed(places).replace("-", "\u2212").replace(".", decimal);
      put(`${way.name}: ${rounded(value, std, decimal)} ${data.unit} (${data.words.band} ${edge(value - half)} \u2026 ${edge(value + half)}). `);
    }
    if (!ways.length) put(`${data.words.unvisited}. `);
    const steps = data.photos.filter((p) => p.low <= kappa && kappa <= p.high).map((p) => p.step);
    put(steps.length ? `${data.words.photos}: ${steps.join(", ")}.` : `${data.words.no_photos}.`);
  };
  const aside = document.getElementById("aside-toggle"), stage = document.getElementById("characteristic-stage");
  if (aside) {
    const quiet = () => stage.classList.toggle("quiet", !aside.checked);
    aside.addEventListener("change", quiet); quiet();
  }
  const clear = () => { kappa = null; mark.replaceChildren(); out.innerHTML = first; };
  stage.addEventListener("pointermove", (event) => {
    const box = plot.getBoundingClientRect(), x = (event.clientX - box.left) / box.width * plot.viewBox.baseVal.width;
    if (x < left || x > right) clear(); else show(frame.x[0] + (x - left) / (right - left) * (frame.x[1] - frame.x[0]));
  });
  stage.addEventListener("pointerleave", () => { if (document.activeElement !== stage) clear(); });
  stage.addEventListener("blur", clear);
  stage.addEventListener("keydown", (event) => {
    const low = Math.min(...data.ways.map((w) => w.kappa[0])), high = Math.max(...data.ways.map((w) => w.kappa[w.kappa.length - 1]));
    const step = (high - low) / (event.shiftKey ? 10 : 50), here = kappa ?? low - step;
    if (event.key === "ArrowRight") show(here + step);
    else if (event.key === "ArrowLeft") show(kappa === null ? high : here - step);
    else if (event.key === "Home") show(low);
    else if (event.key === "End") show(high);
    else if (event.key === "Escape") clear();
    else return;
    event.preventDefault();
  });
  // Equivalent constant stiffness over a range the reader chooses: the mean of the tangent, trapezoidal rule.
  const from = document.getElementById("range-from"), to = document.getElementById("range-to"), result = document.getElementById("range-result");
  if (!from) return;
  const way = data.ways.find((w) => w.method === from.dataset.method);
  const mean = (values, a, b) => {
    const xs = [a, ...way.kappa.filter((x) => x > a && x < b), b], ys = xs.map((x) => between(way.kappa, values, x));
    return xs.slice(1).reduce((sum, x, i) => sum + 0.5 * (ys[i] + ys[i + 1]) * (x - xs[i]), 0) / (b - a);
  };
  const work = () => {
    const a = Math.max(Number(from.value), way.kappa[0]), b = Math.min(Number(to.value), way.kappa[way.kappa.length - 1]);
    if (!(a < b)) { result.textContent = data.words.unvisited; return; }
    const std = way.factor.length ? Math.hypot(...way.factor.map((column) => mean(column, a, b))) : mean(way.std, a, b);
    result.textContent = `${rounded(mean(way.value, a, b), std, decimal)} ${data.unit} (\u03ba ${shown(a, 3, decimal)} \u2026 ${shown(b, 3, decimal)} 1/m)`;
  };
  from.addEventListener("input", work); to.addEventListener("input", work);
})();
// On paper everything is shown, also what is folded on the screen.
addEventListener("beforeprint", () => { for (const fold of document.querySelectorAll("details.paper")) fold.open = true; });
