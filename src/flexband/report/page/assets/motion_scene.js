// A mechanism at an instant of its motion, drawn from the data of motion.py.
"use strict";
window.flexband = window.flexband || {};

flexband.MotionScene = class {
  constructor(data) {
    this.data = data;
    this.times = data.times.values;
    this.count = this.times.length;
    this.samples = data.samples.deviation.shape[0];
    this.prepare();
  }

  /** Return all places of the nominal motion. */
  places() {
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

  /** Find what is the same at all instants: the box, ranges of guides, the largest force. */
  prepare() {
    const { position, forces, samples, bodies, joints, loads } = this.data;
    const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    const reach = (place, radius = 0) => {
      for (const axis of [0, 1]) {
        low[axis] = Math.min(low[axis], place[axis] - radius);
        high[axis] = Math.max(high[axis], place[axis] + radius);
      }
    };
    const round = [...bodies.filter((b) => b.radius), ...joints.flatMap((j) => j.circles || [])];
    for (let frame = 0; frame < this.count; frame++) {
      for (let k = 0; k < position.shape[0]; k++) reach(this.at(k, frame));
      for (const own of round) reach(this.at(own.center, frame), Math.abs(own.radius));
    }
    this.box = [low, high];
    this.size = Math.hypot(high[0] - low[0], high[1] - low[1]) || 1;
    this.ranges = new Map(joints.filter((j) => j.axis !== undefined).map((j) => [j, this.range(j)]));
    this.rests = new Map(loads.filter((l) => l.kind === "spring").map((l) => [l, this.length(l)]));
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

  /** Return the range [m] of a slider along its guide. */
  range(joint) {
    let [low, high] = [Infinity, -Infinity];
    for (let frame = 0; frame < this.count; frame++) {
      const axis = this.vector("direction", joint.axis, frame);
      const [x, y] = flexband.symbols.subtract(this.at(joint.at[0], frame), this.at(joint.at[1], frame));
      const along = x * axis[0] + y * axis[1];
      [low, high] = [Math.min(low, along), Math.max(high, along)];
    }
    return [low, high];
  }

  length(load) {
    return Math.hypot(...flexband.symbols.subtract(this.at(load.at[1], 0), this.at(load.at[0], 0)));
  }

  /** Draw an instant. Options: factor of deviations; samples, forces, names: whether they are drawn. */
  draw(pen, frame, options) {
    const { bodies, joints, supports, loads, forces, traces } = this.data;
    const { symbols } = flexband;
    if (options.samples) this.drawSamples(pen, frame, options.factor);
    for (const trace of traces) this.drawTrace(pen, trace, frame);
    for (const own of joints) this.drawUnder(pen, own, frame);
    for (const own of supports) {
      const place = this.at(own.at, frame);
      if (own.kind === "bearing") symbols.pedestal(pen, place, own.up);
      else symbols.hatch(pen, place, own.up, Math.max(16, own.half / pen.unit + 6));
    }
    for (const own of bodies) this.drawBody(pen, own, frame);
    for (const own of joints) this.drawJoint(pen, own, frame);
    for (const own of loads) this.drawLoad(pen, own, frame);
    for (const own of bodies) {
      if (own.turn !== undefined) {
        symbols.centerOfMass(pen, this.at(own.center, frame), this.vector("direction", own.turn, frame));
      }
    }
    for (const own of joints) this.drawPins(pen, own, frame, options.samples ? null : "paper");
    if (options.forces) for (const own of forces) this.drawForce(pen, own, frame);
    if (options.names) this.drawNames(pen, frame);
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

  drawBody(pen, own, frame) {
    const { symbols } = flexband, at = (k) => this.at(k, frame);
    if (own.kind === "beam") symbols.beam(pen, own.axis.map(at), own.half, own.nodes);
    else if (own.kind === "cable") symbols.cable(pen, own.axis.map(at), own.nodes);
    else if (own.kind === "link") {
      const stays = own.stays.map(at);
      if (stays.length) pen.line([stays[0], at(own.center), stays[1]], { color: "muted", width: 0.9 });
      symbols.link(pen, own.corners.map(at));
    } else if (own.kind === "disc") {
      pen.circle(at(own.center), own.radius, { fill: "pale", width: 0.9, dash: [4, 2] });
      pen.line([at(own.center), at(own.rim)], { width: 0.9 });
    } else if (own.kind === "mass") pen.dot(at(own.center), 11, { fill: "ink" });
    else if (own.kind === "unknown") symbols.unknown(pen, [at(own.center)]);
  }

  /** Draw what is behind the bodies: gears, lines of guides, drives' rings. */
  drawUnder(pen, own, frame) {
    const { symbols } = flexband, places = own.at.map((k) => this.at(k, frame));
    for (const { center, radius, turn } of own.circles || []) {
      symbols.gear(pen, this.at(center, frame), radius, this.vector("direction", turn, frame));
    }
    if (own.kind === "rack") {
      symbols.rack(pen, ...own.line.map((k) => this.at(k, frame)), own.circles[0].radius);
    }
    if (own.axis !== undefined) {
      pen.line(places, { color: "muted", width: 0.7, dash: [9, 3, 2, 3] });
    }
  }

  drawJoint(pen, own, frame) {
    const { symbols } = flexband, places = own.at.map((k) => this.at(k, frame));
    if (own.kind === "rod") pen.line(places, { width: 1.2 });
    else if (own.kind === "slide" || own.kind === "slot") {
      const axis = this.vector("direction", own.axis, frame), [low, high] = this.ranges.get(own);
      const middle = [0, 1].map((k) => places[1][k] + ((low + high) / 2) * axis[k]);
      const half = (high - low) / 2 / pen.unit + 26;
      symbols.rails(pen, middle, axis, half, { ground: own.ground, block: own.kind === "slide", place: places[0] });
    } else if (own.kind === "rotation") {
      const [x, y] = this.vector("direction", own.turn, frame);
      const start = Math.atan2(y, x) + 0.35 * own.sense;
      symbols.turning(pen, places[0], start, 1.7 * own.sense, 24, { color: "drive", width: 1.6 });
    } else if (own.kind === "travel" || own.kind === "path") {
      pen.dot(places[0], 11, { fill: null, color: "drive" });
    } else if (own.kind === "unknown") symbols.unknown(pen, places);
  }

  drawPins(pen, own, frame, fill) {
    const at = (k) => this.at(k, frame);
    if (own.kind === "pin") pen.dot(at(own.at[0]), 7, { fill });
    else if (own.kind === "weld") pen.square(at(own.at[0]), 6);
    else if (own.kind === "rod") own.at.forEach((k) => pen.dot(at(k), 5, { fill: "ink" }));
  }

  drawLoad(pen, own, frame) {
    const { symbols } = flexband, places = own.at.map((k) => this.at(k, frame));
    const style = { color: "load", width: 1.6 };
    if (own.kind === "spring") {
      own.walls.forEach((wall, k) => {
        const outward = symbols.subtract(places[1 - k], places[k]);
        if (wall && Math.hypot(...outward)) symbols.hatch(pen, places[k], outward, 12);
      });
      symbols.spring(pen, ...places, { ...own, rest: this.rests.get(own) });
    } else if (own.kind === "torsion") {
      symbols.torsion(pen, places[0], own);
      const start = Math.PI * (0.5 - 0.75 * own.sense);
      if (own.sense) symbols.turning(pen, places[0], start, 1.5 * Math.PI * own.sense, 24, style);
    } else if (own.kind === "moment") {
      const start = Math.PI * (-0.5 - 0.25 * own.sense);
      symbols.turning(pen, places[0], start, 1.5 * Math.PI * own.sense, 15, style);
    } else if (own.kind === "distributed") {
      own.shares.forEach(([x, y], k) => {
        const size = Math.hypot(x, y), head = Math.min(6, 20 * size);
        const tail = pen.local(places[k], [x, y], [[-29 * size, 0]])[0];
        if (size > 0.15) pen.arrow([tail, places[k]], { ...style, head, width: 1 });
      });
    } else if (own.kind === "gravity") this.drawGravity(pen, own.field);
    else if (own.kind === "law") {
      symbols.unknown(pen, places, "load");
    } else symbols.unknown(pen, places, "load");
  }

  /** Draw the field of gravity in a corner, the upper right one if it is free. */
  drawGravity(pen, field) {
    if (!Math.hypot(...field)) return;
    const shown = `${pen.width} ${pen.height} ${pen.zoom} ${pen.middle}`;
    if (this.shown !== shown) [this.shown, this.corner] = [shown, pen.freeCorner(this.places())];
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
    for (const own of this.data.bodies) {
      const number = own.axis ? own.axis[Math.floor(own.axis.length / 2)] : own.center;
      pen.name(this.at(number, frame), own.name, { italic: true, shift: [0, 15] });
    }
    const seen = new Set();
    for (const own of this.data.joints) {
      const drive = ["rotation", "travel", "path"].includes(own.kind);
      const key = `${own.at[0]} ${drive}`, place = this.at(own.at[0], frame);
      const shift = drive ? [-14, 27] : [seen.has(key) ? -14 : 12, -14];
      seen.add(key);
      pen.name(place, own.name, { color: drive ? "drive" : "ink", shift });
    }
  }
};
