"use strict";
// Choosing a point: in a chart, in a table, or by a link #place/point. Everything else follows from what is chosen.
(() => {
  const study = JSON.parse(document.getElementById("study").textContent);
  const places = new Map(study.places.map((place) => [place.slug, place]));
  const views = new Map();
  let current = null;

  const rows = (body, lines) => body.replaceChildren(...lines.map((cells) => {
    const row = document.createElement("tr");
    row.append(...cells.map((words) => {
      const cell = document.createElement("td");
      cell.textContent = words;
      return cell;
    }));
    return row;
  }));

  class View {
    constructor(place) {
      this.place = place;
      this.section = document.getElementById(place.slug);
      this.panel = this.section.querySelector(".panel");
      this.tabs();
      this.charts();
      this.table();
      this.compare = new Compare(this.section.querySelector(".compare"), place);
      if (place.first) this.select(place.first);
    }

    select(slug) {
      const point = this.place.points.find((one) => one.slug === slug);
      if (!point) return false;
      this.selected = slug;
      for (const mark of this.section.querySelectorAll(".charts .point")) {
        const is = mark.dataset.point === slug;
        mark.classList.toggle("selected", is);
        mark.setAttribute("aria-pressed", is);
        mark.tabIndex = is ? 0 : -1;
      }
      for (const row of this.section.querySelectorAll("tr[data-row]")) {
        row.classList.toggle("selected", row.dataset.row === slug);
      }
      this.show(point);
      this.compare.left(slug);
      return true;
    }

    show(point) {
      const shown = document.getElementById("panel").content.cloneNode(true);
      const part = (name) => shown.querySelector(`[data-${name}]`);
      part("name").textContent = point.name;
      part("claim").textContent = `claims ${point.claim}`;
      part("front").textContent = point.fronts.length ? `on the front: ${point.fronts.join(", ")}` : "";
      part("command").textContent = point.command;
      const copy = part("copy");
      copy.addEventListener("click", async () => {
        try {
          await navigator.clipboard.writeText(point.command);
          copy.textContent = "Copied";
        } catch {
          // No clipboard without leave: the words are marked, and the user copies them.
          getSelection().selectAllChildren(copy.parentElement.querySelector("code"));
          copy.textContent = "Marked";
        }
      });
      const settings = point.set.map(([key, value]) => [key, value, "Setting of this rung."]);
      part("figures").replaceChildren(...[...settings, ...point.figures].map(([name, words, meaning]) => {
        const row = document.createElement("tr");
        row.title = meaning;
        const head = document.createElement("th");
        head.scope = "row";
        head.textContent = name;
        const cell = document.createElement("td");
        const [figure, interval] = words.split(/ (?=\[)/);
        cell.textContent = figure;
        if (interval) {
          const of = document.createElement("span");
          of.className = "of";
          of.textContent = ` ${interval}`;
          cell.append(of);
        }
        row.append(head, cell);
        return row;
      }));
      rows(part("bands"), point.bands);
      rows(part("passes"), point.passes);
      rows(part("memory"), point.memory);
      part("bands-details").hidden = !point.bands.length;
      part("passes-details").hidden = !point.passes.length && !point.memory.length;
      this.panel.replaceChildren(shown);
    }

    tabs() {
      const tabs = [...this.section.querySelectorAll('[role="tab"]')];
      const open = (tab) => {
        for (const other of tabs) {
          other.setAttribute("aria-selected", other === tab);
          other.tabIndex = other === tab ? 0 : -1;
          document.getElementById(other.getAttribute("aria-controls")).hidden = other !== tab;
        }
      };
      tabs.forEach((tab, k) => {
        tab.addEventListener("click", () => open(tab));
        tab.addEventListener("keydown", (event) => {
          const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
          if (!step) return;
          event.preventDefault();
          const next = tabs[(k + step + tabs.length) % tabs.length];
          open(next);
          next.focus();
        });
      });
    }

    charts() {
      for (const chart of this.section.querySelectorAll(".charts .chart")) {
        const points = [...chart.querySelectorAll(".point")];
        const middle = (point) => {
          const box = point.lastElementChild.getBoundingClientRect();
          return [box.x + box.width / 2, box.y + box.height / 2];
        };
        const nearest = (event) => {
          let [best, least] = [null, 26];
          for (const point of points) {
            const [x, y] = middle(point);
            const distance = Math.hypot(x - event.clientX, y - event.clientY);
            if (distance < least) [best, least] = [point, distance];
          }
          return best;
        };
        chart.addEventListener("pointermove", (event) => {
          const near = nearest(event);
          for (const point of points) point.classList.toggle("near", point === near);
          chart.style.cursor = near ? "pointer" : "";
        });
        chart.addEventListener("pointerleave", () => points.forEach((point) => point.classList.remove("near")));
        chart.addEventListener("click", (event) => {
          const near = nearest(event);
          if (near) choose(this.place.slug, near.dataset.point);
        });
        chart.addEventListener("keydown", (event) => {
          const from = event.target.closest?.(".point");
          if (!from) return;
          if (event.key === "Enter" || event.key === " ") {
            event.preventDefault();
            choose(this.place.slug, from.dataset.point);
            return;
          }
          const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
          if (!step) return;
          event.preventDefault();
          const order = [...points].sort((a, b) => middle(a)[0] - middle(b)[0]);
          const next = order[(order.indexOf(from) + step + order.length) % order.length];
          choose(this.place.slug, next.dataset.point);
          next.focus();
        });
      }
    }

    table() {
      const table = this.section.querySelector(".points");
      const heads = [...table.querySelectorAll("thead th")];
      heads.forEach((head, column) => head.querySelector("button").addEventListener("click", () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        for (const other of heads) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        const body = table.tBodies[0];
        const key = (row) => row.cells[column].dataset.value ?? null;
        const words = (row) => row.cells[column].textContent;
        const compare = (a, b) => {
          if (column < 3) return words(a).localeCompare(words(b), "en", { numeric: true });
          // What was not measured comes last, either way.
          if (key(a) === null || key(b) === null) return ((key(a) === null) - (key(b) === null)) * (down ? -1 : 1);
          return key(a) - key(b);
        };
        body.append(...[...body.rows].sort((a, b) => compare(a, b) * (down ? -1 : 1)));
      }));
    }
  }

  // Two pictures over each other: one wiped away, flipped, or replaced by the map of their difference.
  class Compare {
    constructor(into, place) {
      this.place = place;
      this.pictures = place.points.filter((point) => point.picture !== null)
        .map((point) => ({ slug: point.slug, name: point.name, image: point.picture, difference: point.difference }));
      if (place.reference !== null) {
        this.pictures.unshift({ slug: "", name: "reference", image: place.reference, difference: null });
      }
      if (!this.pictures.length) return;
      into.append(document.getElementById("compare").content.cloneNode(true));
      this.part = (name) => into.querySelector(`[data-${name}]`);
      this.stage = into.querySelector(".stage");
      for (const side of ["left", "right"]) {
        this.part(side).append(...this.pictures.map((picture) => new Option(picture.name, picture.slug)));
        this.part(side).addEventListener("change", () => {
          this.show();
          if (side === "left" && this.part("left").value) choose(place.slug, this.part("left").value);
        });
      }
      this.part("right").selectedIndex = 0;
      this.part("wipe").addEventListener("input", () => this.show());
      this.part("zoom").addEventListener("change", () => this.show());
      for (const button of into.querySelectorAll("[data-mode]")) {
        if (button.tagName === "BUTTON") button.addEventListener("click", () => this.press(button.dataset.mode));
      }
      this.mode = "wipe";
      this.flipped = false;
      this.show();
    }

    left(slug) {
      if (!this.mode || !this.pictures.some((picture) => picture.slug === slug)) return;
      this.part("left").value = slug;
      this.show();
    }

    press(mode) {
      if (!this.mode) return;
      if (mode === "flip" && this.mode === "flip") this.flipped = !this.flipped;
      this.mode = mode === this.mode && mode === "difference" ? "wipe" : mode;
      this.show();
    }

    show() {
      const chosen = (side) => this.pictures.find((picture) => picture.slug === this.part(side).value) ?? this.pictures[0];
      const [left, right] = [chosen("left"), chosen("right")];
      const put = (image, number, alt) => {
        const uri = number === null || number === undefined ? "" : study.images[number];
        if (uri) { if (image.getAttribute("src") !== uri) image.src = uri; } else image.removeAttribute("src");
        image.alt = uri ? alt : "";
      };
      put(this.part("image-left"), left.image, `${this.place.title}: ${left.name}`);
      put(this.part("image-right"), right.image, `${this.place.title}: ${right.name}`);
      const shown = left.difference !== null ? left : right;
      put(this.part("image-difference"), shown.difference, `FLIP of ${shown.name} against the reference`);
      const mode = this.mode;
      this.stage.dataset.mode = mode;
      const wipe = mode === "flip" ? (this.flipped ? 0 : 100) : Number(this.part("wipe").value);
      this.stage.style.setProperty("--wipe", `${wipe}%`);
      this.part("image-difference").hidden = mode !== "difference" || !this.part("image-difference").hasAttribute("src");
      const zoom = Number(this.part("zoom").value);
      this.stage.style.width = zoom ? `${this.place.size[0] * zoom}px` : "";
      this.stage.parentElement.style.width = zoom ? "" : "100%";
      for (const button of this.stage.closest(".compare").querySelectorAll("button[data-mode]")) {
        button.setAttribute("aria-pressed", button.dataset.mode === mode);
      }
      this.part("tag-left").textContent = mode === "difference" ? `FLIP: ${shown.name}` : mode === "flip" && this.flipped ? "" : left.name;
      this.part("tag-right").textContent = mode === "wipe" || (mode === "flip" && this.flipped) ? right.name : "";
      this.part("hint").textContent = {
        wipe: "Drag across the picture, or use the arrow keys.",
        flip: "Press F, or the button again, to flip between left and right.",
        difference: "Where FLIP sees a difference from the reference: dark is none, bright is great.",
      }[mode];
    }
  }

  // Says how many of the pictures can be shown: a page that lost some should not pass for a whole one.
  const count = async () => {
    const shown = await Promise.all(study.images.map((uri) => new Promise((done) => {
      const image = new Image();
      image.onload = () => done(image.naturalWidth > 0);
      image.onerror = () => done(false);
      image.src = uri || "data:,";
    })));
    const good = shown.filter((is) => is).length;
    document.querySelector("[data-pictures]").textContent = `${good} of ${shown.length} can be shown.`;
  };

  const choose = (place, point) => {
    const view = views.get(place);
    if (!view || !view.select(point)) return false;
    current = view;
    history.replaceState(null, "", `#${place}/${point}`);
    return true;
  };

  // #place or #place/point; anything else is left alone.
  const follow = () => {
    const [place, point] = decodeURIComponent(location.hash.slice(1)).split("/");
    const view = views.get(place);
    if (!view) return;
    current = view;
    if (point && view.select(point)) view.section.scrollIntoView({ behavior: "instant" });
  };

  for (const place of places.values()) views.set(place.slug, new View(place));
  current = views.values().next().value ?? null;
  follow();
  if (study.images.length) count();
  addEventListener("hashchange", follow);
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("input:not([type=range]), select, textarea")) return;
    const mode = { f: "flip", d: "difference" }[event.key.toLowerCase()];
    if (!mode || !current) return;
    // The place that is looked at: the one nearest to the middle of the window.
    const off = (view) => {
      const box = view.section.getBoundingClientRect();
      return Math.max(0, box.top - innerHeight / 2, innerHeight / 2 - box.bottom);
    };
    [...views.values()].sort((a, b) => off(a) - off(b))[0].compare.press(mode);
  });
})();
