(() => {
  const data = JSON.parse(document.getElementById("data").textContent), decimal = data.decimal;
  const body = document.querySelector("#specimens tbody");
  // Words are searched, numbers are not: who types 42 wants cable-42, not every stiffness with a 42 in it.
  const words = (node) => [...node.cells].filter((cell) => !cell.classList.contains("num")).map((cell) => cell.textContent).join(" ").toLowerCase();
  const rows = [...body.rows].map((node, index) => ({
    node, index, text: words(node), box: node.querySelector("input"), shown: true,
    status: node.dataset.status, verdict: node.dataset.verdict, type: node.dataset.type,
  }));
  const find = (id) => document.getElementById(id);
  const search = find("search"), filters = ["status", "verdict", "type"].map(find).filter(Boolean);
  // Rows are laid out a hundred at a time as the reader scrolls: two thousand at once would take seconds.
  const PAGE = 100;
  let order = rows, limit = PAGE;
  const show = () => {
    let count = 0;
    for (const row of order) {
      row.node.hidden = !row.shown || count >= limit;
      count += row.shown;
    }
    find("shown").textContent = data.shown.replace("{shown}", count).replace("{total}", rows.length);
  };
  const filter = () => {
    const wanted = search.value.trim().toLowerCase().split(/\s+/);
    for (const row of rows) {
      row.shown = wanted.every((word) => row.text.includes(word)) && filters.every((f) => !f.value || row[f.id] === f.value);
    }
    limit = PAGE;
    show();
  };
  const frame = find("specimens");
  frame.addEventListener("scroll", () => {
    if (frame.scrollTop + frame.clientHeight > frame.scrollHeight - 600 && limit < rows.length) { limit += PAGE; show(); }
  }, { passive: true });
  addEventListener("beforeprint", () => { limit = rows.length; show(); });
  search.addEventListener("input", filter);
  filters.forEach((f) => f.addEventListener("change", filter));
  // Sorting: empty cells stay last in both directions; ties keep the order of the batch.
  const natural = new Intl.Collator(document.documentElement.lang, { numeric: true });
  for (const button of document.querySelectorAll("#specimens th button")) {
    button.addEventListener("click", () => {
      const head = button.parentElement, column = head.cellIndex, down = head.getAttribute("aria-sort") === "ascending";
      for (const other of head.parentElement.querySelectorAll("[aria-sort]")) other.setAttribute("aria-sort", "none");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const sign = down ? -1 : 1, number = button.dataset.kind === "number";
      const keys = rows.map((row) => { const cell = row.node.cells[column]; return number ? cell.dataset.v : cell.textContent; });
      const sorted = rows.map((row, i) => ({ row, key: keys[i] }));
      sorted.sort((a, b) => {
        const none = (a.key === undefined || a.key === "") - (b.key === undefined || b.key === "");
        if (none) return none;
        return sign * (number ? a.key - b.key : natural.compare(a.key, b.key)) || a.row.index - b.row.index;
      });
      order = sorted.map((entry) => entry.row);
      for (const row of order) row.node.hidden = true;
      body.append(...order.map((row) => row.node));
      limit = PAGE; frame.scrollTop = 0;
      show();
    });
  }
  // Overlay: colours of Okabe and Ito, then the same with dashes.
  const colours = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f"], dashes = ["", "7 3", "2 3", "9 3 2 3"];
  const svg = "http://www.w3.org/2000/svg", L = 62, R = 14, T = 12, B = 48;
  const make = (name, values, text) => {
    const node = document.createElementNS(svg, name);
    for (const key in values) node.setAttribute(key, values[key]);
    if (text !== undefined) node.textContent = text;
    return node;
  };
  const ticks = (low, high) => {
    const raw = (high - low) / 5, power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].find((m) => m * power >= raw) * power;
    const list = [];
    for (let i = Math.ceil(low / step); i * step <= high * (1 + 1e-9); i += 1) list.push(i * step);
    return list;
  };
  const LIMIT = 40;
  const draw = () => {
    const place = find("overlay-plot"), W = Math.max(340, Math.min(640, place.clientWidth)), H = Math.round(60 + W / 2);
    const chosen = rows.filter((row) => row.box && row.box.checked);
    find("overlay-empty").hidden = chosen.length > 0;
    place.replaceChildren();
    if (!chosen.length) return;
    const curves = chosen.slice(0, LIMIT).map((row) => ({ name: row.node.cells[1].textContent, points: data.rows[row.index] }));
    const xs = curves.flatMap((c) => c.points[0]), tops = curves.flatMap((c) => c.points[1].map((v, i) => v + data.half * c.points[2][i]));
    const x0 = Math.min(...xs), x1 = Math.max(...xs), y0 = Math.min(0, ...curves.flatMap((c) => c.points[1])), y1 = 1.05 * Math.max(...tops);
    const X = (v) => L + (v - x0) / (x1 - x0) * (W - L - R), Y = (v) => H - B - (v - y0) / (y1 - y0) * (H - T - B);
    const plot = make("svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": curves.map((c) => c.name).join(", ") });
    for (const v of ticks(x0, x1)) plot.append(make("line", { class: "grid-line", x1: X(v), x2: X(v), y1: T, y2: H - B }), make("text", { x: X(v), y: H - B + 16, "text-anchor": "middle" }, shown(v, 4, decimal)));
    for (const v of ticks(y0, y1)) plot.append(make("line", { class: "grid-line", x1: L, x2: W - R, y1: Y(v), y2: Y(v) }), make("text", { x: L - 6, y: Y(v) + 4, "text-anchor": "end" }, shown(v, 4, decimal)));
    plot.append(make("text", { x: (L + W - R) / 2, y: H - 8, "text-anchor": "middle" }, data.axes[0]));
    plot.append(make("text", { transform: `translate(14 ${(T + H - B) / 2}) rotate(-90)`, "text-anchor": "middle" }, data.axes[1]));
    const key = document.createElement("ul"); key.className = "key";
    curves.forEach((curve, i) => {
      const [k, v, std] = curve.points, colour = colours[i % colours.length], dash = dashes[Math.floor(i / colours.length) % dashes.length];
      const edge = (sign) => k.map((x, j) => `${X(x).toFixed(1)} ${Y(v[j] + sign * data.half * std[j]).toFixed(1)}`);
      if (curves.length <= 8) plot.append(make("path", { d: `M${edge(1).join("L")}L${edge(-1).reverse().join("L")}Z`, fill: colour, "fill-opacity": 0.14 }));
      plot.append(make("path", { class: "curve", d: "M" + k.map((x, j) => `${X(x).toFixed(1)} ${Y(v[j]).toFixed(1)}`).join("L"), fill: "none", stroke: colour, "stroke-width": 2, "stroke-dasharray": dash }));
      const entry = document.createElement("li"), sample = make("svg", { viewBox: "0 0 34 10" });
      sample.append(make("line", { x1: 0, x2: 34, y1: 5, y2: 5, stroke: colour, "stroke-width": 2.5, "stroke-dasharray": dash }));
      entry.append(sample, curve.name); key.append(entry);
    });
    if (chosen.length > LIMIT) { const more = document.createElement("li"); more.textContent = `+ ${chosen.length - LIMIT}`; key.append(more); }
    place.append(plot, key);
  };
  body.addEventListener("change", draw);
  find("select-all").addEventListener("click", () => { for (const row of rows) if (row.box && row.shown) row.box.checked = true; draw(); });
  find("clear").addEventListener("click", () => { for (const row of rows) if (row.box) row.box.checked = false; draw(); });
  filter(); draw();
})();
