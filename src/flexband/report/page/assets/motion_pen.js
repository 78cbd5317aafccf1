// A pen for drawings of mechanisms: places in metres, sizes of symbols in points (1/72 inch).
"use strict";
window.flexband = window.flexband || {};

/** Colours of a drawing as CSS expressions, which follow the page's light and dark mode. */
flexband.drawingColors = {
  ink: "var(--ink, #222)",
  paper: "var(--paper, #fff)",
  muted: "var(--muted, #667)",
  pale: "color-mix(in srgb, var(--ink, #222) 12%, var(--paper, #fff))",
  flexible: "var(--accent, #1f78b4)",
  filled: "color-mix(in srgb, var(--accent, #1f78b4) 25%, var(--paper, #fff))",
  sample: "var(--second, #d95f02)",
  load: "var(--second, #d95f02)",
  drive: "color-mix(in srgb, #1b9e50 80%, var(--ink, #222))",
  reaction: "color-mix(in srgb, #c2257c 80%, var(--ink, #222))",
};

/** A pen on a canvas. `box` is [[left, bottom], [right, top]] in metres. */
flexband.Pen = class {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.colors = {};
    this.zoom = 1;
    this.center = null; // [m], of the box if null
  }

  /** Read the colours of the page, which may have changed. */
  readColors() {
    const probe = document.createElement("span");
    this.canvas.parentElement.append(probe);
    for (const [name, css] of Object.entries(flexband.drawingColors)) {
      probe.style.color = css;
      this.colors[name] = getComputedStyle(probe).color;
    }
    probe.remove();
  }

  /** Fit the box into a canvas of a width and a height in CSS pixels, and erase it. */
  begin(box, width, height) {
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== w || this.canvas.height !== h) {
      this.canvas.width = w;
      this.canvas.height = h;
    }
    this.width = width;
    this.height = height;
    this.names = []; // boxes [pixels] of what is written
    this.point = Math.min(1.35, Math.max(0.72, width / 640)); // pixels per point
    const [[left, bottom], [right, top]] = box;
    const margin = Math.min(48 * this.point, 0.16 * Math.min(width, height));
    const fits = Math.min(
      (width - 2 * margin) / Math.max(right - left, 1e-12),
      (height - 2 * margin) / Math.max(top - bottom, 1e-12),
    );
    const tiny = right - left < 1e-12 && top - bottom < 1e-12;
    this.scale = (tiny ? 1e3 : fits) * this.zoom; // pixels per metre
    this.unit = this.point / this.scale; // metres per point
    this.middle = this.center || [(left + right) / 2, (bottom + top) / 2];
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.context.globalAlpha = 1;
    this.context.lineJoin = "round";
    this.context.clearRect(0, 0, width, height);
  }

  /** Return a place in pixels. */
  pixel([x, y]) {
    const across = this.width / 2 + (x - this.middle[0]) * this.scale;
    return [across, this.height / 2 - (y - this.middle[1]) * this.scale];
  }

  /** Return a place in metres. */
  place([x, y]) {
    const across = this.middle[0] + (x - this.width / 2) / this.scale;
    return [across, this.middle[1] - (y - this.height / 2) / this.scale];
  }

  /** Return places from coordinates [pt] along a direction and to its left; null lifts the pen. */
  local([ox, oy], [dx, dy], shape) {
    const size = Math.hypot(dx, dy) || 1, [x, y] = [(dx / size) * this.unit, (dy / size) * this.unit];
    return shape.map((p) => p && [ox + p[0] * x - p[1] * y, oy + p[0] * y + p[1] * x]);
  }

  /** Return the middle [pixels] of a corner from which places are far; the upper right one if it is. */
  freeCorner(places) {
    const [x, y] = [24 * this.point, 26 * this.point], enough = 40 * this.point;
    const corners = [[this.width - x, y], [x, y], [this.width - x, this.height - y]];
    const far = corners.map(() => enough);
    for (const place of places) {
      const at = this.pixel(place);
      corners.forEach((own, k) => { far[k] = Math.min(far[k], Math.hypot(own[0] - at[0], own[1] - at[1])); });
    }
    return corners[far.indexOf(Math.max(...far))];
  }

  /** Return the length [pt] of a line through places. */
  length(points) {
    const own = points.slice(1).map((p, k) => Math.hypot(p[0] - points[k][0], p[1] - points[k][1]));
    return own.reduce((a, b) => a + b, 0) / this.unit;
  }

  trace(points, closed) {
    const context = this.context;
    let down = false;
    context.beginPath();
    for (const point of points) {
      if (point === null) { down = false; continue; }
      const [x, y] = this.pixel(point);
      if (down) context.lineTo(x, y);
      else context.moveTo(x, y);
      down = true;
    }
    if (closed) context.closePath();
  }

  /** Draw a line through places. */
  line(points, style = {}) {
    this.trace(points, style.closed);
    this.stroke(style);
  }

  stroke({ color = "ink", width = 1, dash = [], alpha = 1, cap = "butt" }) {
    const context = this.context;
    context.globalAlpha = alpha;
    context.strokeStyle = this.colors[color];
    context.lineWidth = width * this.point;
    context.lineCap = cap;
    context.setLineDash(dash.map((part) => part * this.point));
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  fill(color, alpha = 1) {
    this.context.globalAlpha = alpha;
    this.context.fillStyle = this.colors[color];
    this.context.fill();
    this.context.globalAlpha = 1;
  }

  /** Fill a polygon and draw its edge. */
  area(points, { fill = "pale", edge = "ink", width = 1, alpha = 1, dash = [] } = {}) {
    this.trace(points, true);
    if (fill) this.fill(fill, alpha);
    if (width) this.stroke({ color: edge, width, dash, cap: "round" });
  }

  /** Draw a circle of a radius [m]. */
  circle(center, radius, style = {}) {
    const [x, y] = this.pixel(center);
    this.context.beginPath();
    this.context.arc(x, y, Math.abs(radius) * this.scale, 0, 2 * Math.PI);
    if (style.fill) this.fill(style.fill, style.alpha);
    if (style.width !== 0) this.stroke(style.fill ? { ...style, alpha: 1 } : style);
  }

  /** Draw a disc of a diameter [pt]. */
  dot(center, size, { fill = "paper", color = "ink", width = 1.2, alpha = 1 } = {}) {
    this.circle(center, (size / 2) * this.unit, { fill, color, width, alpha });
  }

  /** Draw a disc, a square, a diamond or the letter f of a size [pt]. */
  mark(center, { marker, size, fill = null, color = "ink", width }) {
    const half = size / 2, direction = marker === "diamond" ? [1, 1] : [1, 0];
    const corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    if (marker === "disc") this.dot(center, size, { fill, color, width });
    else if (marker === "f") this.text(center, "f", { color, italic: true });
    else this.area(this.local(center, direction, corners), { fill, edge: color, width });
  }

  /** Draw an arrow along places with a head of a length [pt]. */
  arrow(points, { head = 8, ...style } = {}) {
    const tip = points[points.length - 1];
    const far = (p) => Math.hypot(p[0] - tip[0], p[1] - tip[1]) > 0.9 * head * this.unit;
    const shaft = points.filter(far), last = shaft[shaft.length - 1] || points[0];
    const along = [tip[0] - last[0], tip[1] - last[1]];
    const corners = this.local(tip, along, [[0, 0], [-head, head / 3.2], [-head, -head / 3.2]]);
    if (shaft.length) this.line([...shaft, this.local(tip, along, [[-0.8 * head, 0]])[0]], style);
    this.area(corners, { fill: style.color || "ink", width: 0, alpha: style.alpha });
  }

  font(italic) {
    return `${italic ? "italic " : ""}${Math.max(11, 9.5 * this.point)}px system-ui, sans-serif`;
  }

  /** Write a name beside a place, on the side where it overlaps with no other; or nowhere. */
  name(place, text, { shift: [dx, dy], ...style }) {
    const [x, y] = this.pixel(place), { context, point } = this;
    context.font = this.font(style.italic);
    const half = [context.measureText(text).width / 2 + 2, 8];
    for (const [right, up] of [[1, 1], [1, -1], [-1, 1], [-1, -1], [1.8, 1.8], [-1.8, 1.8], [1.8, -1.8], [-1.8, -1.8]]) {
      const shift = [right * dx, up * dy], at = [x + shift[0] * point, y - shift[1] * point];
      const free = this.names.every((own) => [0, 1].some((k) => Math.abs(own.at[k] - at[k]) > own.half[k] + half[k]));
      if (!free) continue;
      this.names.push({ at, half });
      this.text(place, text, { ...style, shift });
      return;
    }
  }

  /** Write a text at a place with a halo; shift [pt] to the right and up. */
  text(place, text, { color = "ink", shift = [0, 0], align = "center", italic = false } = {}) {
    const [x, y] = this.pixel(place), context = this.context;
    context.font = this.font(italic);
    context.textAlign = align;
    context.textBaseline = "middle";
    context.lineWidth = 3.5;
    context.strokeStyle = this.colors.paper;
    context.fillStyle = this.colors[color];
    const at = [x + shift[0] * this.point, y - shift[1] * this.point];
    context.strokeText(text, ...at);
    context.fillText(text, ...at);
  }
};
