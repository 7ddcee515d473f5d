// Contents of the page, from its headings.
const contents = () => {
  const place = document.querySelector("nav.contents");
  const names = new Set([...document.querySelectorAll("[id]")].map((part) => part.id));
  const headings = [...document.querySelectorAll("main h2")].filter((heading) => !heading.closest("[hidden]"));
  if (headings.length < 3) return;
  const list = place.querySelector("ul");
  for (const heading of headings) {
    const part = heading.closest("figure, section") ?? heading;
    if (!part.id || part.querySelector("h2") !== heading) {
      let name = heading.textContent.trim().toLowerCase().replace(/[^a-z0-9]+/g, "-");
      while (names.has(name)) name += "-2";
      names.add(name);
      heading.id = name;
    }
    const link = document.createElement("a");
    link.href = `#${part.id && part.querySelector("h2") === heading ? part.id : heading.id}`;
    link.textContent = heading.textContent.trim();
    link.addEventListener("click", () => { const fold = heading.closest("details"); if (fold) fold.open = true; });
    const entry = document.createElement("li");
    entry.append(link);
    list.append(entry);
  }
  place.hidden = false;
};

// Tables are sorted by a click on the head of a column: up, down, as they were.
const sortable = (table) => {
  const [head, body] = [table.tHead?.rows[0], table.tBodies[0]];
  if (!head || !body || body.rows.length < 3 || table.classList.contains("fixed")) return;
  const original = [...body.rows];
  const text = (row, column) => (row.cells[column]?.innerText ?? "").replace(/[▼▸\u2007]/g, "").trim();
  const number = (words) => {
    const found = words.replace(/−/g, "-").replace(/,/g, "").match(/^(?:under |over |<|±)?\s*([+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?)/i);
    return found ? Number(found[1]) : NaN;
  };
  const isEmpty = (words) => ["", "-", "–"].includes(words);
  const sort = (column, direction) => {
    if (!direction) return body.append(...original);
    const keyed = original.map((row) => [row, text(row, column)]);
    const numeric = keyed.every(([, words]) => isEmpty(words) || !Number.isNaN(number(words)));
    const order = ([, one], [, other]) => {
      if (isEmpty(one) || isEmpty(other)) return isEmpty(one) - isEmpty(other);
      return direction * (numeric ? number(one) - number(other) : one.localeCompare(other, "en", { numeric: true }));
    };
    return body.append(...keyed.sort(order).map(([row]) => row));
  };
  [...head.cells].forEach((cell, column) => {
    if (!cell.textContent.trim() || cell.classList.contains("unsorted")) return;
    const button = document.createElement("button");
    button.type = "button";
    button.className = "sort";
    button.title = "Sort by this column";
    button.append(...cell.childNodes);
    cell.append(button);
    button.addEventListener("click", () => {
      const before = cell.getAttribute("aria-sort");
      [...head.cells].forEach((other) => other.removeAttribute("aria-sort"));
      const next = { ascending: "descending", descending: null }[before] ?? (before ? null : "ascending");
      if (next) cell.setAttribute("aria-sort", next);
      sort(column, { ascending: 1, descending: -1 }[next] ?? 0);
    });
  });
};

contents();
document.querySelectorAll("main table").forEach(sortable);
