// Symbols of mechanisms, as symbols.py draws them. Sizes are in points.
"use strict";
window.flexband = window.flexband || {};

flexband.symbols = (function () {
  const UP = null;
  const RAIL = 7, TOOTH = 4, PITCH = 5;
  const LEAST_APART = 10; // of marks at nodes
  const DASHPOT = [[-2, 0], [-2, 4], [-2, -4], UP, [-10, 6], [8, 6], [8, -6], [-10, -6], UP, [8, 0]];
  const ACTUATOR = [[-12, 0], [-12, 5], [12, 5], [12, -5], [-12, -5], [-12, 0], UP, [12, 0]];
  const subtract = (a, b) => [a[0] - b[0], a[1] - b[1]];
  const between = (a, b, share) => [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];

  /** A rigid body: a plate with rounded corners, or a bar between two corners. */
  function link(pen, corners) {
    for (const [color, width] of [["ink", 8], ["pale", 6]]) {
      pen.trace(corners, true);
      pen.fill(color);
      pen.stroke({ color, width, cap: "round" });
    }
  }

  /** A circle with two black quarters, which turn with the body. */
  function centerOfMass(pen, place, turn) {
    pen.dot(place, 7, { width: 0.8 });
    const [x, y] = pen.pixel(place), angle = Math.atan2(-turn[1], turn[0]), context = pen.context;
    for (const start of [angle, angle + Math.PI]) {
      context.beginPath();
      context.moveTo(x, y);
      context.arc(x, y, 3.5 * pen.point, start - Math.PI / 2, start);
      pen.fill("ink");
    }
  }

  /** A beam to scale: its sides, and marks at its nodes if they are far enough apart. */
  function beam(pen, axis, half, nodes) {
    const last = axis.length - 1;
    const across = axis.map((_, k) => {
      const along = subtract(axis[Math.min(k + 1, last)], axis[Math.max(k - 1, 0)]);
      const size = Math.hypot(...along) || 1;
      return [-along[1] / size, along[0] / size];
    });
    const beside = (k, reach) => [axis[k][0] + reach * across[k][0], axis[k][1] + reach * across[k][1]];
    const side = (sign) => axis.map((_, k) => beside(k, sign * half[k]));
    pen.area([...side(1), ...side(-1).reverse()], { fill: "filled", edge: "flexible" });
    if (nodes * pen.length(axis) < LEAST_APART * last) return; // they would be a hatching
    for (let k = 0; k <= last; k += nodes) {
      const reach = Math.max(half[k], 3 * pen.unit);
      pen.line([beside(k, reach), beside(k, -reach)], { color: "flexible", width: 0.8 });
    }
  }

  /** A cable: a line, and dots at its nodes if they are far enough apart. */
  function cable(pen, axis, nodes) {
    pen.line(axis, { color: "flexible", width: 1.8 });
    if (nodes * pen.length(axis) < LEAST_APART * (axis.length - 1)) return;
    for (let k = 0; k < axis.length; k += nodes) {
      pen.dot(axis[k], 3.5, { fill: "flexible", width: 0 });
    }
  }

  /** The surface of the ground, 2 half long, depth behind the origin. */
  function hatch(pen, origin, outward, half, depth = 0) {
    const pieces = [[-depth, -half], [-depth, half]];
    for (let y = 3 - half; y <= half + 0.1; y += 4) pieces.push(UP, [-depth, y], [-depth - 4, y - 4]);
    pen.line(pen.local(origin, outward, pieces), { width: 0.9 });
  }

  /** A bearing that stands on the ground. */
  function pedestal(pen, place, up) {
    pen.area(pen.local(place, up, [[0, 0], [-13, -7], [-13, 7]]), { fill: "paper" });
    hatch(pen, place, up, 12, 13);
  }

  /** A guide along an axis around its middle, and a block or a pin in it at a place. */
  function rails(pen, middle, axis, half, { ground, block, place }) {
    for (const side of [-1, 1]) {
      const normal = subtract(pen.local([0, 0], axis, [[0, -side]])[0], [0, 0]);
      if (ground) hatch(pen, middle, normal, half, RAIL);
      else pen.line(pen.local(middle, axis, [[-half, side * RAIL], [half, side * RAIL]]));
    }
    const corners = [[-13, -RAIL], [13, -RAIL], [13, RAIL], [-13, RAIL]];
    if (block) pen.area(pen.local(place, axis, corners));
    else pen.dot(place, 7);
  }

  /** A zigzag, a dashpot, or both side by side; an actuator if it is neither. */
  function spring(pen, start, end, { elastic, damped, rest }) {
    const along = subtract(end, start), length = Math.hypot(...along) / pen.unit;
    const first = rest / pen.unit, half = Math.min(0.33 * first, 45) * Math.min(length / (first || 1), 1.45);
    const shapes = [];
    if (elastic) {
      const teeth = 2 * Math.max(Math.round(Math.min(0.33 * first, 45) / 4.5), 2), width = 1.6 * half;
      const zigzag = [[-0.8 * half, 0]];
      for (let k = 0; k < teeth; k++) {
        zigzag.push([-0.8 * half + ((k + 0.5) / teeth) * width, k % 2 ? -5 : 5]);
      }
      shapes.push([...zigzag, [0.8 * half, 0]]);
    }
    if (damped || !elastic) shapes.push(damped ? DASHPOT : ACTUATOR);
    const lift = 9 * (shapes.length - 1), pieces = [[-length / 2, 0], [-half, 0]];
    shapes.forEach((shape, k) => {
      const shift = k ? -lift : lift;
      const own = [[-half, 0], ...shape, [half, 0]].map((p) => p && [p[0], p[1] + shift]);
      pieces.push(UP, [-half, 0], ...own, [half, 0]);
    });
    pieces.push(UP, [half, 0], [length / 2, 0]);
    if (length > 0) pen.line(pen.local(between(start, end, 0.5), along, pieces));
    for (const place of [start, end]) pen.dot(place, 3, { fill: "ink", width: 0 });
  }

  /** A spiral about a pin, a dashpot bent around it, or both. */
  function torsion(pen, place, { elastic, damped }) {
    const pieces = [], turned = (radius, turn) => [radius * Math.cos(turn), radius * Math.sin(turn)];
    for (let k = 0; elastic && k < 120; k++) {
      pieces.push(turned(4 + (10 * k) / 119, Math.PI * (0.5 + (4.5 * k) / 119)));
    }
    const around = elastic ? 20 : 15;
    const parts = [[[-22, 0], [-2, 0], [-2, 3], [-2, -3]], [[-9, 4], [8, 4], [8, -4], [-9, -4]], [[8, 0], [22, 0]]];
    for (const part of damped ? parts : []) {
      pieces.push(UP);
      for (let k = 0; k + 1 < part.length; k++) {
        for (let j = 0; j < 9; j++) {
          const [x, y] = between(part[k], part[k + 1], j / 8);
          pieces.push(turned(around + y, Math.PI / 4 + x / around));
        }
      }
    }
    pen.line(pen.local(place, [1, 0], pieces));
  }

  /** An arrow around a place, from an angle over a sweep [rad]. */
  function turning(pen, place, start, sweep, radius, style) {
    const arc = [];
    for (let k = 0; k < 40; k++) {
      const angle = start + (sweep * k) / 39;
      arc.push([radius * Math.cos(angle), radius * Math.sin(angle)]);
    }
    pen.arrow(pen.local(place, [1, 0], arc), style);
  }

  /** A pitch circle with teeth, which turn and point outward on a ring, radius < 0. */
  function gear(pen, center, radius, turn) {
    if (radius > 0) pen.circle(center, radius, { fill: "pale", alpha: 0.5, width: 0 });
    pen.circle(center, radius, { width: 0.9 });
    const size = Math.abs(radius) / pen.unit, inner = Math.abs(radius / pen.unit - TOOTH);
    const count = Math.max(Math.floor((2 * Math.PI * size) / PITCH), 8), teeth = [];
    for (let k = 0; k < count; k++) {
      const [x, y] = [Math.cos((2 * Math.PI * k) / count), Math.sin((2 * Math.PI * k) / count)];
      teeth.push(UP, [size * x, size * y], [inner * x, inner * y]);
    }
    pen.line(pen.local(center, turn, teeth), { width: 0.9 });
    if (radius > 0) pen.line([center, pen.local(center, turn, [[size, 0]])[0]], { width: 0.9 });
  }

  /** A rack with teeth on the side away from a pinion of this radius. */
  function rack(pen, start, end, radius) {
    const along = subtract(end, start), length = Math.hypot(...along) / pen.unit;
    const pieces = [[0, 0], [length, 0]];
    for (let x = PITCH / 2; x < length; x += PITCH) {
      pieces.push(UP, [x, 0], [x, -Math.sign(radius) * TOOTH]);
    }
    pen.line(pen.local(start, along, pieces), { width: 0.9 });
  }

  /** Dashed lines between places, and a diamond at the first. */
  function unknown(pen, places, color = "ink") {
    for (const place of places.slice(1)) {
      pen.line([places[0], place], { color, width: 0.8, dash: [4, 3] });
    }
    for (const place of places.slice(0, 1)) {
      pen.area(pen.local(place, [1, 1], [[-4, -4], [4, -4], [4, 4], [-4, 4]]), { fill: "paper", edge: color });
    }
  }

  return {
    link, centerOfMass, beam, cable, hatch, pedestal, rails, spring, torsion, turning, gear, rack,
    unknown, subtract, between,
  };
})();
