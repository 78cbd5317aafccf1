// A mechanism at an instant of its motion, drawn from the data of motion.py.
"use strict";
window.flexband = window.flexband || {};

flexband.MotionScene = class {
  constructor(data) {
    this.data = data;
    this.times = data.times.values;
    this.onAxis = data.places ? data.places.values : this.times; // of the charts
    this.count = this.times.length;
    this.samples = data.samples.deviation.shape[0];
    this.prepare();
  }

  /** Return all places of the nominal motion. */
  visited() {
    const { shape } = this.data.position;
    return Array.from({ length: shape[0] * this.count }, (_, k) => this.at(Math.floor(k / this.count), k % this.count));
  }

  /** Return a vector of the nominal motion: of kind position, direction or force. */
  vector(kind, number, frame) {
    const { values } = this.data[kind], first = 2 * number * this.count + frame;
    return [values[first], values[first + this.count]];
  }

  at(number, frame) {
    return this.vector("position", number, frame);
  }

  /** Return the deviation [m] of a point of an outline of a sample from the nominal motion. */
  deviation(sample, number, frame) {
    const { shape, values } = this.data.samples.deviation;
    const first = 2 * (sample * shape[1] + number) * this.count + frame;
    return [values[first], values[first + this.count]];
  }

  /** Find what is the same at all instants: the box, the largest force, the largest deviations. */
  prepare() {
    const { box, forces, samples } = this.data, [low, high] = box;
    this.box = box;
    this.size = Math.hypot(high[0] - low[0], high[1] - low[1]) || 1;
    this.largestForce = 0;
    for (const own of forces) {
      for (let frame = 0; frame < this.count; frame++) {
        const size = Math.hypot(...this.vector("force", own.force, frame));
        if (size <= this.largestForce) continue;
        this.largestForce = size;
        this.largestAt = { name: own.name, time: this.times[frame] };
      }
    }
    if (this.largestForce < 1e-12) this.largestForce = 0; // rounding
    this.apart = new Float64Array(this.count); // largest deviation at each instant [m]
    for (let s = 0; s < this.samples; s++) {
      for (let k = 0; k < samples.points.length; k++) {
        for (let frame = 0; frame < this.count; frame++) {
          const size = Math.hypot(...this.deviation(s, k, frame));
          if (size > this.apart[frame]) this.apart[frame] = size;
        }
      }
    }
    this.largestApart = this.apart.reduce((a, b) => Math.max(a, b), 0);
  }

  /** Return the places of a stroke [m], null where the pen is lifted; see shapes.py. */
  places(pen, { frames, first, count }, instant) {
    const axes = frames.map((frame) => {
      let vector = frame.fixed || [1, 0];
      if (frame.turn !== undefined) vector = this.vector("direction", frame.turn, instant);
      else if (frame.ends) {
        const [start, end] = frame.ends.map((number) => this.at(number, instant));
        vector = [end[0] - start[0], end[1] - start[1]];
      }
      const length = Math.hypot(...vector), size = length || 1;
      return { origin: this.at(frame.origin, instant), scale: frame.shares ? length : 1,
        x: vector[0] / size, y: vector[1] / size };
    });
    const { values } = this.data.vertices;
    return Array.from({ length: count }, (_, k) => {
      const [a, b, right, above] = values.subarray(4 * (first + k), 4 * (first + k + 1));
      if (Number.isNaN(a + right)) return null;
      const { origin, scale, x, y } = axes[axes.length > 1 ? k : 0];
      const along = scale * a + pen.unit * right, up = scale * b + pen.unit * above;
      return [origin[0] + along * x - up * y, origin[1] + along * y + up * x];
    });
  }

  /** Draw an instant. Options: factor of deviations; samples, forces, names: whether they are drawn. */
  draw(pen, frame, options) {
    const { forces, shapes, traces } = this.data;
    if (options.samples) this.drawSamples(pen, frame, options.factor);
    for (const trace of traces) this.drawTrace(pen, trace, frame);
    for (const shape of shapes) this.drawShape(pen, shape, frame, options.samples);
    if (options.forces) for (const own of forces) this.drawForce(pen, own, frame);
    if (options.names) this.drawNames(pen, frame);
  }

  /** Draw a line or a mark; pins are transparent in front of samples. */
  drawShape(pen, shape, frame, transparent) {
    if (shape.kind === "name") return;
    if (shape.kind === "field") return this.drawField(pen, shape.vector);
    const strokes = shape.strokes.map((stroke) => this.places(pen, stroke, frame));
    const hole = transparent ? null : "paper", fill = shape.fill === "hole" ? hole : shape.fill || null;
    if (shape.spacing && !flexband.areApart(pen, shape.kind === "mark" ? strokes[0] : strokes.map((s) => s[0]), shape.spacing)) return;
    for (const points of strokes) {
      if (shape.kind === "mark") for (const place of points) pen.mark(place, { ...shape, fill });
      else if (shape.head) pen.arrow(points, shape);
      else if (shape.closed) pen.area(points, { ...shape, fill, edge: shape.color });
      else pen.line(points, shape);
    }
  }

  drawSamples(pen, frame, factor) {
    const { points, outlines } = this.data.samples;
    const style = { color: "sample", width: 1, alpha: Math.min(0.5, 0.28 + 2 / this.samples) };
    const nominal = points.map((number) => this.at(number, frame));
    for (let s = 0; s < this.samples; s++) {
      const moved = nominal.map(([x, y], k) => {
        const [dx, dy] = this.deviation(s, k, frame);
        return [x + factor * dx, y + factor * dy];
      });
      for (const own of outlines) {
        const line = own.points.map((k) => moved[k]);
        if (own.radius) pen.circle(line[0], own.radius, style);
        if (line.length > 1) pen.line(line, { ...style, closed: own.closed });
        else pen.dot(line[0], 4, { fill: "sample", width: 0, alpha: style.alpha });
      }
    }
  }

  drawTrace(pen, trace, frame) {
    const path = [];
    for (let k = 0; k < this.count; k++) path.push(this.at(trace.at, k));
    pen.line(path, { color: "muted", width: 0.8 });
    pen.line(path.slice(0, frame + 1), { color: "muted", width: 1.4 });
  }

  /** Draw the vector of a field in a corner, the upper right one if it is free. */
  drawField(pen, field) {
    if (!Math.hypot(...field)) return;
    const shown = `${pen.width} ${pen.height} ${pen.zoom} ${pen.middle}`;
    if (this.shown !== shown) [this.shown, this.corner] = [shown, pen.freeCorner(this.visited())];
    const corner = pen.place(this.corner);
    pen.arrow(pen.local(corner, field, [[-16, 0], [16, 0]]), { color: "load", width: 1.6 });
    pen.text(corner, "g", { color: "load", shift: [-10, 0] });
  }

  drawForce(pen, own, frame) {
    const force = this.vector("force", own.force, frame), size = Math.hypot(...force);
    const length = (64 * size) / (this.largestForce || 1);
    if (length < 1.5) return;
    const color = own.kind === "force" ? "load" : "reaction", head = Math.min(8, 3 + 0.25 * length);
    pen.arrow(pen.local(this.at(own.at, frame), force, [[0, 0], [length, 0]]), { color, width: 1.8, head });
  }

  drawNames(pen, frame) {
    const seen = new Set();
    for (const { text, color, italic, strokes } of this.data.shapes.filter((own) => own.kind === "name")) {
      const places = this.places(pen, strokes[0], frame);
      const place = [0, 1].map((axis) => places.reduce((sum, own) => sum + own[axis], 0) / places.length);
      const key = `${color} ${pen.pixel(place).map(Math.round)}`;
      const beside = [seen.has(key) ? -14 : 12, -14];
      if (!italic) seen.add(key);
      pen.name(place, text, { color, italic, shift: italic ? [0, 15] : beside });
    }
  }
};

/** Return whether places are at least so many points apart, on average. */
flexband.areApart = (pen, places, least) => pen.length(places) >= least * (places.length - 1);
