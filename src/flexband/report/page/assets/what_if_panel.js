// The what-if panel: sliders for tolerances and scatter, and the bands that they would give.
"use strict";
flexband.starters = flexband.starters || [];

flexband.starters.push(function (everything) {
  const data = everything.what_if, section = document.getElementById("what-if");
  if (!data || !section) return;
  const panel = section.querySelector(".panel") || section;
  const inputs = new flexband.WhatIfInputs(data), STEPS = flexband.WhatIfInputs.STEPS;

  const shown = (x, digits = 4) => flexband.power(Number(x.toPrecision(digits)));
  const limits = flexband.whatIfLimits(everything);
  const update = []; // functions that show the state of the sliders

  const element = flexband.element;

  function slider(label, min, max, onInput) {
    const own = element("input", { type: "range", min, max, step: "any", "aria-label": label });
    own.step = "1";
    own.addEventListener("input", () => {
      onInput(Number(own.value));
      changed();
    });
    return own;
  }

  /** Return a number without the rounding of its last digits. */
  const tidy = (number) => flexband.withMinus(String(Number(number.toPrecision(12))));

  /** Return the controls of an interval: two ends on the track of what the runs cover. */
  function interval({ name, unit, lower, upper, scale }, k) {
    const suffix = unit && ` ${unit}`, value = element("output");
    const thumbs = ["lower", "upper"].map((end, e) => slider(
      `${end} end of ${name}`, 0, STEPS, (to) => inputs.move(k, e, to, symmetric.checked)));
    const range = element("span", { className: "what-if-range" });
    update.push(() => {
      const [low, high] = inputs.ends(k).map((x) => x * scale), middle = shown((low + high) / 2, 8);
      value.textContent = `${tidy(low)} … ${tidy(high)} (${middle} ± ${shown((high - low) / 2)})${suffix}`;
      thumbs.forEach((own, e) => {
        own.value = inputs.intervals[k][e];
        own.setAttribute("aria-valuetext", tidy([low, high][e]) + suffix);
      });
      const [from, to] = inputs.intervals[k].map((at) => at / STEPS);
      range.style.left = `${100 * from}%`;
      range.style.width = `${100 * (to - from)}%`;
    });
    const marks = element("div", { className: "what-if-marks" },
      element("span", { textContent: `▏${tidy(lower * scale)}` }), element("span", { textContent: `${tidy(upper * scale)}▕` }));
    const track = element("div", { className: "what-if-track screen-only" }, range, ...thumbs);
    marks.classList.add("screen-only");
    return element("div", { className: "what-if-input", role: "group", "aria-label": name },
      element("div", { className: "what-if-name" }, element("strong", { textContent: name }), value),
      track, marks);
  }

  /** Return the control of a size: the scatter of a random input, or the radius of a play. */
  function size({ name, word, of, unit, least, scale }, k) {
    const value = element("output");
    const thumb = slider(`${word} of ${name}, per cent of the study's`, 100 * least, 100, (to) => {
      inputs.scales[k] = to / 100;
    });
    update.push(() => {
      const part = Math.round(100 * inputs.scales[k]);
      thumb.value = part;
      value.textContent = `${of} ${shown(scale * inputs.size(k))}${unit && ` ${unit}`}, ${part} % of the study's ${word}`;
      thumb.setAttribute("aria-valuetext", value.textContent);
    });
    const marks = element("div", { className: "what-if-marks screen-only" },
      element("span", { textContent: least ? `${100 * least} %` : `no ${word}` }),
      element("span", { textContent: "100 %▕" }));
    return element("div", { className: "what-if-input", role: "group", "aria-label": name },
      element("div", { className: "what-if-name" }, element("strong", { textContent: name }), value),
      element("div", { className: "what-if-track screen-only" }, thumb), marks);
  }

  const symmetric = element("input", { type: "checkbox" });
  symmetric.checked = true;
  const reset = element("button", { type: "button", textContent: "Reset" });
  const copy = element("button", { type: "button", className: "screen-only", textContent: "Copy" });
  const python = element("code");
  const status = element("p", { className: "what-if-status", role: "status" });
  const heads = ["output", "study", "now", "change", "largest expected error"];
  const rows = data.outputs.map(({ name }) => {
    const cells = heads.slice(1).map((head) => element("td", { "data-of": head }));
    return { cells, row: element("tr", {}, element("th", { scope: "row", textContent: name }), ...cells) };
  });
  const cells = heads.map((text) => element("th", { scope: "col", textContent: text }));
  const table = element("table", { className: "what-if-table" },
    element("caption", { textContent: "Largest width of the error bar" }),
    element("thead", {}, element("tr", {}, ...cells)),
    element("tbody", {}, ...rows.map(({ row }) => row)));

  const notes = [
    "The expected error is the largest one of the output in the whole study; in brackets relative to the " +
      "largest width now. narrowed() in Python estimates it anew, by the check runs within the narrower inputs.",
    ...(limits ? ["Margins are those at the times of the charts, without their expected error. " +
      "`flexband check` computes the probabilities of violating limits."] : []),
    ...(data.models.some(({ kind }) => kind === "phases")
      ? ["An error bar of a vibration may grow with less scatter: the waves of all samples then " +
        "cancel less in the mean."] : []),
    ...data.remarks,
  ];
  const keep = element("label", {}, symmetric, " keep the middle of intervals");
  panel.append(
    element("p", { textContent: "Tighten tolerances and scatter: the bands follow from the surrogate, " +
      "without new runs. The sliders stop at the ranges that were simulated; for wider ranges run the study again. " +
      `${limits ? "Margins follow below; contributions" : "Requirements, contributions"} and numbers ` +
      "elsewhere on this page remain those of the study." }),
    element("div", { className: "what-if-inputs" },
      ...data.intervals.map(interval), ...data.sizes.map(size)),
    element("p", { className: "what-if-buttons screen-only" },
      ...(data.intervals.length ? [keep] : []), reset),
    element("div", { className: "what-if-scroll" }, table, ...(limits ? [limits.table] : [])),
    status,
    element("p", { className: "what-if-python" }, "The same in Python: ", python, " ", copy),
    ...notes.map((text) => element("p", { className: "what-if-note", text })));

  /** Show how wide the error bars are; of some of the times only, this is about. */
  function widths({ times, error_bar: [lower, upper], done }) {
    rows.forEach(({ cells }, o) => {
      let width = 0;
      for (let k = o * times.length; data.width[o] && k < (o + 1) * times.length; k++) {
        width = Math.max(width, upper[k] - lower[k]);
      }
      const { unit } = data.outputs[o], study = data.width[o], about = done ? "" : "≈ ";
      const change = study > 0 ? Number((100 * (width / study - 1)).toFixed(2)) : 0;
      const error = data.expected_error && data.expected_error[o];
      const part = error !== null && width > 0 ? ` (${shown(100 * error / width, 2)} %)` : "";
      const units = unit ? ` ${unit}` : "";
      [`${shown(study)}${units}`, `${about}${shown(width)}${units}`,
        `${change < 0 ? "−" : change > 0 ? "+" : ""}${shown(Math.abs(change), 2)} %`,
        error === null ? "not known" : `± ${shown(error, 2)}${units}${part}`,
      ].forEach((text, c) => { cells[c].textContent = text; });
    });
    if (done) {
      status.textContent = inputs.changed
        ? rows.map(({ cells }, o) => `${data.outputs[o].name}: ${cells[0].textContent} → ` +
          `${cells[1].textContent}, ${cells[2].textContent}`).join("; ")
        : "The inputs are those of the study.";
    }
  }

  function tell(detail) {
    document.dispatchEvent(new CustomEvent("flexband:what-if", { detail }));
  }

  // While bounds are computed, only the newest position of the sliders waits.
  let ask = null, busy = false, waiting = false, asked = "";

  function request() {
    ask = ask || flexband.boundsBeside(data, (found) => {
      if (inputs.changed) {
        widths(found);
        if (limits) limits.show(found);
        if (found.done) tell({ label: asked, ...found });
      }
      busy = !found.done;
      table.setAttribute("aria-busy", String(busy));
      if (waiting && !busy) request();
    });
    waiting = busy;
    if (!busy) {
      busy = true;
      table.setAttribute("aria-busy", "true");
      asked = inputs.label();
      ask(inputs.parts());
    }
  }

  function changed() {
    update.forEach((show) => show());
    python.textContent = inputs.python();
    if (inputs.changed) {
      request();
    } else {
      showStudy();
      tell(null);
    }
  }

  function showStudy() {
    const bound = (sign) => Float64Array.from(data.width, (width) => sign * width / 2);
    widths({ times: [0], error_bar: [bound(-1), bound(1)], done: true });
    if (limits) limits.show(null);
  }

  reset.addEventListener("click", () => {
    inputs.reset();
    changed();
  });
  copy.addEventListener("click", async () => {
    const text = python.textContent;
    try {
      await navigator.clipboard.writeText(text);
      copy.textContent = "Copied";
    } catch {
      getSelection().selectAllChildren(python);
      copy.textContent = "Selected";
    }
    setTimeout(() => { copy.textContent = "Copy"; }, 1500);
  });
  update.forEach((show) => show());
  python.textContent = inputs.python();
  showStudy();
});
