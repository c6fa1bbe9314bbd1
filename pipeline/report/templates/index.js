(() => {
  const find = (id) => document.getElementById(id), read = (id) => JSON.parse(find(id).textContent);
  const data = read("data"), decimal = data.decimal, say = data.words;
  // Half of all data: read when the first curve is drawn.
  let stored;
  const curve = (index) => {
    stored ??= read("curves");
    const [[low, high], v, std] = stored[index];
    return [v.map((_, i) => low + (high - low) * i / (v.length - 1)), v, std];
  };
  const frame = find("specimens"), table = frame.querySelector("table");
  // Cells as `_cells` in pipeline/report/index.py writes them.
  const [NAME, HREF, TYPE, STATE, VERDICT, LOW, , HIGH, , K0, , RMS, , USED, PHOTOS, TROUBLES, REASON, LANGUAGE, SHAPES, CAUSES] = Array(20).keys();
  // Words are searched, numbers are not: who types 42 wants cable-42, not every stiffness with a 42 in it.
  const rows = data.cells.map((cells, index) => ({
    cells, index, checked: false, state: data.states[cells[STATE]], verdict: data.verdicts[cells[VERDICT]], text: "",
  }));
  for (const row of rows) row.text = [row.cells[NAME], row.cells[TYPE], row.state, row.verdict, row.cells[REASON], row.cells[CAUSES]].join(" ").toLowerCase();

  const svg = "http://www.w3.org/2000/svg";
  const node = (parent, name, values, text) => {
    const made = name === "svg" || parent.namespaceURI === svg ? document.createElementNS(svg, name) : document.createElement(name);
    for (const key in values) if (values[key]) made.setAttribute(key, values[key]);
    if (text !== undefined) made.textContent = text;
    parent.append(made);
    return made;
  };
  // One row, as index.html has the first ones.
  const draw = (body, row) => {
    const cells = row.cells, line = node(body, "tr", { class: cells[STATE] });
    line.row = row;
    const pick = node(line, "td", { class: "pick" });
    if (cells[LOW] !== null) node(pick, "input", { type: "checkbox", "aria-label": `${say.select} ${cells[NAME]}` }).checked = row.checked;
    const name = node(line, "td");
    if (cells[HREF]) node(name, "a", { href: cells[HREF] }, cells[NAME]); else name.textContent = cells[NAME];
    const shape = node(line, "td", { class: "shape" });
    if (cells[SHAPES]) node(node(shape, "svg", { viewBox: `0 0 ${data.size[0]} ${data.size[1]}`, role: "img", "aria-label": say.shape_alt }), "path", { d: cells[SHAPES] });
    if (data.typed) node(line, "td", { class: "kind" }, cells[TYPE]);
    node(line, "td", {}, row.state);
    const verdict = node(line, "td", {}, row.verdict);
    if (cells[CAUSES]) { node(verdict, "br"); node(verdict, "b", {}, cells[CAUSES]); }
    for (const column of [LOW, HIGH, K0, RMS]) node(line, "td", { class: "num" }, cells[column + 1]);
    node(line, "td", { class: "num" }, cells[PHOTOS]);
    const why = node(line, "td", { class: "why" });
    if (cells[REASON]) { node(why, "b", {}, cells[TROUBLES]); why.append(" "); node(why, "span", { lang: cells[LANGUAGE] }, cells[REASON]); }
  };

  // Rows are drawn in blocks as the reader scrolls to them; a block that is far away is an empty body of its height.
  // Blocks that were seen stay, up to so many: ten thousand rows at once would take seconds and half a gigabyte.
  const KEPT = 12;
  let order = rows, wanted = rows, height = 60;
  const seen = new Set();
  const fill = (body) => {
    if (seen.has(body)) seen.delete(body);
    else {
      body.removeAttribute("style");
      for (const row of wanted.slice(body.first, body.first + data.block)) draw(body, row);
      height = body.getBoundingClientRect().height / body.rows.length || height;
    }
    seen.add(body);
  };
  const empty = (body) => {
    const tall = body.getBoundingClientRect().height;
    body.replaceChildren();
    body.style.cssText = `display:block;height:${tall}px`;
    seen.delete(body);
  };
  const watcher = new IntersectionObserver((entries) => {
    for (const entry of entries) if (entry.isIntersecting) fill(entry.target);
    for (const body of [...seen].slice(0, Math.max(0, seen.size - KEPT))) empty(body);
  }, { root: frame, rootMargin: "800px 0px" });
  const show = () => {
    watcher.disconnect();
    seen.clear();
    for (const body of [...table.tBodies]) body.remove();
    for (let first = 0; first === 0 || first < wanted.length; first += data.block) {
      const body = node(table, "tbody");
      body.first = first;
      if (first === 0) fill(body); else body.style.cssText = `display:block;height:${height * Math.min(data.block, wanted.length - first)}px`;
      watcher.observe(body);
    }
    frame.scrollTop = 0;
    table.setAttribute("aria-rowcount", wanted.length + 1);
    find("shown").textContent = say.shown.replace("{shown}", wanted.length).replace("{total}", rows.length);
  };
  addEventListener("beforeprint", () => { watcher.disconnect(); for (const body of table.tBodies) if (!seen.has(body)) fill(body); });

  const search = find("search"), filters = [["status", STATE], ["verdict", VERDICT], ["type", TYPE]].map(([id, at]) => ({ node: find(id), at })).filter((f) => f.node);
  const filter = () => {
    const words = search.value.trim().toLowerCase().split(/\s+/);
    wanted = order.filter((row) => filters.every((f) => !f.node.value || row.cells[f.at] === f.node.value) && words.every((word) => row.text.includes(word)));
    show();
  };
  search.addEventListener("input", filter);
  filters.forEach((f) => f.node.addEventListener("change", filter));
  // Sorting: empty cells stay last in both directions; ties keep the order of the batch.
  const natural = new Intl.Collator(document.documentElement.lang, { numeric: true });
  const said = { [STATE]: (row) => row.state, [VERDICT]: (row) => row.verdict };
  for (const button of document.querySelectorAll("#specimens th button")) {
    button.addEventListener("click", () => {
      const head = button.parentElement, by = Number(button.dataset.by), down = head.getAttribute("aria-sort") === "ascending";
      for (const other of head.parentElement.querySelectorAll("[aria-sort]")) other.setAttribute("aria-sort", "none");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const sign = down ? -1 : 1, key = said[by] || ((row) => row.cells[by]), none = (value) => value === null || value === "";
      order = rows.map((row) => ({ row, key: key(row) })).sort((a, b) => none(a.key) - none(b.key)
        || (none(a.key) ? 0 : sign * (typeof a.key === "number" ? a.key - b.key : natural.compare(a.key, b.key)))
        || a.row.index - b.row.index).map((entry) => entry.row);
      filter();
    });
  }

  // Plots: characteristics over each other, and means of a type. Colours of Okabe and Ito, then the same with dashes.
  const colours = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f"], dashes = ["", "7 3", "2 3", "9 3 2 3"];
  const L = 62, R = 14, T = 12, B = 48;
  const ticks = (low, high) => {
    const raw = (high - low) / 5 || 1, power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].find((m) => m * power >= raw) * power;
    const list = [];
    for (let i = Math.ceil(low / step); i * step <= high * (1 + 1e-9); i += 1) list.push(i * step);
    return list;
  };
  // Bands are {k, v, std, colour, opacity}, lines {k, v, colour, dash, width, class}; key entries {text, colour, dash, opacity}.
  const plot = (place, alt, bands, lines, key) => {
    const W = Math.max(340, Math.min(640, place.clientWidth)), H = Math.max(290, Math.round(60 + W / 2));
    const xs = [...lines, ...bands].flatMap((c) => [c.k[0], c.k[c.k.length - 1]]), ys = [0, ...lines.flatMap((c) => c.v), ...bands.flatMap((c) => c.v.map((v, i) => v + data.half * c.std[i]))];
    const x0 = Math.min(...xs), x1 = Math.max(...xs), y0 = Math.min(...ys), y1 = 1.05 * Math.max(...ys);
    const X = (v) => L + (v - x0) / (x1 - x0 || 1) * (W - L - R), Y = (v) => H - B - (v - y0) / (y1 - y0 || 1) * (H - T - B);
    const path = (k, v) => k.map((x, j) => `${X(x).toFixed(1)} ${Y(v[j]).toFixed(1)}`);
    place.replaceChildren();
    const drawn = node(place, "svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": alt });
    for (const v of ticks(x0, x1)) { node(drawn, "line", { class: "grid-line", x1: X(v), x2: X(v), y1: T, y2: H - B }); node(drawn, "text", { x: X(v), y: H - B + 16, "text-anchor": "middle" }, shown(v, 4, decimal)); }
    for (const v of ticks(y0, y1)) { node(drawn, "line", { class: "grid-line", x1: L, x2: W - R, y1: Y(v), y2: Y(v) }); node(drawn, "text", { x: L - 6, y: Y(v) + 4, "text-anchor": "end" }, shown(v, 4, decimal)); }
    node(drawn, "text", { x: (L + W - R) / 2, y: H - 8, "text-anchor": "middle" }, data.axes[0]);
    node(drawn, "text", { transform: `translate(14 ${(T + H - B) / 2}) rotate(-90)`, "text-anchor": "middle" }, data.axes[1]);
    for (const { k, v, std, colour, opacity } of bands) {
      const edge = (sign) => path(k, v.map((value, j) => Math.max(y0, value + sign * data.half * std[j])));
      node(drawn, "path", { d: `M${edge(1).join("L")}L${edge(-1).reverse().join("L")}Z`, fill: colour, "fill-opacity": opacity });
    }
    for (const { k, v, colour, dash, width, name, opacity } of lines) node(drawn, "path", { class: name, "stroke-opacity": name === "single" ? opacity : 1, d: "M" + path(k, v).join("L"), fill: "none", stroke: colour, "stroke-width": width, "stroke-dasharray": dash });
    const list = node(place, "ul", { class: "key" });
    for (const { text, colour, dash, opacity } of key) {
      const entry = node(list, "li");
      if (colour) node(node(entry, "svg", { viewBox: "0 0 34 10" }), "line", { x1: "0", x2: "34", y1: "5", y2: "5", stroke: colour, "stroke-width": opacity ? "9" : "2.5", "stroke-opacity": opacity, "stroke-dasharray": dash });
      entry.append(text);
    }
  };

  const LIMIT = 40;
  const overlay = () => {
    const chosen = rows.filter((row) => row.checked), place = find("overlay-plot");
    find("overlay-empty").hidden = chosen.length > 0;
    place.replaceChildren();
    if (!chosen.length) return;
    const curves = chosen.slice(0, LIMIT).map((row, i) => {
      const [k, v, std] = curve(row.index), look = { colour: colours[i % colours.length], dash: dashes[Math.floor(i / colours.length) % dashes.length] };
      return { k, v, std, opacity: 0.14, width: 2, name: "curve", text: row.cells[NAME], ...look };
    });
    const key = curves.map(({ text, colour, dash }) => ({ text, colour, dash }));
    if (chosen.length > LIMIT) key.push({ text: `+ ${chosen.length - LIMIT}` });
    plot(place, curves.map((c) => c.text).join(", "), curves.length <= 8 ? curves : [], curves, key);
  };
  table.addEventListener("change", (event) => { event.target.closest("tr").row.checked = event.target.checked; overlay(); });
  const tick = (list, checked) => { for (const row of list) row.checked = checked && row.cells[LOW] !== null; for (const box of table.querySelectorAll("input")) box.checked = box.closest("tr").row.checked; overlay(); };
  find("select-all").addEventListener("click", () => tick(wanted, true));
  find("clear").addEventListener("click", () => tick(rows, false));

  const mean = (place, { alt, members, kappa, mean, std, scatter }) => {
    const single = members.map(curve).map(([k, v]) => ({ k, v, colour: "var(--muted)", width: 0.7, opacity: 0.6, name: "single" }));
    const blue = "var(--inverse)", bands = [{ k: kappa, v: mean, std: scatter, colour: blue, opacity: 0.14 }, { k: kappa, v: mean, std, colour: blue, opacity: 0.3 }];
    const key = [{ text: say.pooled_single, colour: "var(--muted)" }, { text: say.pooled_scatter, colour: blue, opacity: 0.14 }, { text: say.pooled_mean, colour: blue, opacity: 0.3 }];
    plot(place, alt, bands, [...single, { k: kappa, v: mean, colour: blue, width: 2.2, name: "mean" }], key);
  };
  // Figures are drawn when the reader comes near.
  const places = [...document.querySelectorAll(".pooled")];
  const near = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) if (isIntersecting && !target.firstChild) mean(target, data.pooled[places.indexOf(target)]);
  }, { rootMargin: "600px 0px" });
  for (const place of places) near.observe(place);
  addEventListener("beforeprint", () => { for (const place of places) if (!place.firstChild) mean(place, data.pooled[places.indexOf(place)]); });
  filter(); overlay();
})();
