// Shapes of the viewer: tubes along paths of nodes with closed ends and a stripe, spheres, and lines.
"use strict";

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => scale(a, 1 / (Math.hypot(...a) || 1));
const mix = (a, b, s) => add(scale(a, 1 - s), scale(b, s));

// Any unit vector across another.
function across(t) {
  const least = t.map(Math.abs).indexOf(Math.min(...t.map(Math.abs)));
  return unit(cross(t, [0, 1, 2].map((k) => (k === least ? 1 : 0))));
}

// A vector carried along by the smallest turn that takes one unit tangent to another.
function carried(v, from, to) {
  const axis = cross(from, to);
  const moved = add(add(scale(v, dot(from, to)), cross(axis, v)), scale(axis, dot(axis, v) / Math.max(1 + dot(from, to), 1e-6)));
  return unit(subtract(moved, scale(to, dot(moved, to))));
}

// Vertices and triangles, growing as shapes are added. A vertex: position, normal, colour, angle from the stripe (cosine).
class Mesh {
  constructor() {
    this.vertices = new Float32Array(1 << 14);
    this.indices = new Uint32Array(1 << 14);
    this.clear();
  }

  clear() {
    this.used = this.count = 0;
  }

  vertex(position, normal, colour, stripe) {
    if (this.used + 10 > this.vertices.length) {
      const larger = new Float32Array(2 * this.vertices.length);
      larger.set(this.vertices);
      this.vertices = larger;
    }
    this.vertices.set(position, this.used);
    this.vertices.set(normal, this.used + 3);
    this.vertices.set(colour, this.used + 6);
    this.vertices[this.used + 9] = stripe;
    this.used += 10;
    return this.used / 10 - 1;
  }

  triangle(a, b, c) {
    if (this.count + 3 > this.indices.length) {
      const larger = new Uint32Array(2 * this.indices.length);
      larger.set(this.indices);
      this.indices = larger;
    }
    this.indices[this.count++] = a;
    this.indices[this.count++] = b;
    this.indices[this.count++] = c;
  }

  // Two rings of vertices, from their first ones, joined by a band.
  band(first, second, sides) {
    for (let k = 0; k < sides; k++) {
      this.triangle(first + k, first + k + 1, second + k);
      this.triangle(second + k, first + k + 1, second + k + 1);
    }
  }

  // A tube: rings of {centre, tangent, side, radius, colour}, side being where the stripe is; half spheres close its ends.
  tube(rings, sides, closed) {
    const caps = 4;
    const profile = [];
    const start = rings[0];
    const end = rings[rings.length - 1];
    const cap = (ring, way, k) => {
      const angle = (0.5 * Math.PI * k) / caps;
      const centre = add(ring.centre, scale(ring.tangent, way * ring.radius * Math.sin(angle)));
      return { ...ring, centre, shrunk: Math.cos(angle), lean: way * Math.sin(angle) };
    };
    if (!closed) for (let k = caps; k > 0; k--) profile.push(cap(start, -1, k));
    for (const ring of rings) profile.push({ ...ring, shrunk: 1, lean: 0 });
    if (!closed) for (let k = 1; k <= caps; k++) profile.push(cap(end, 1, k));
    let before = -1;
    for (const ring of profile) {
      const other = cross(ring.tangent, ring.side);
      let first = -1;
      for (let k = 0; k <= sides; k++) {
        const angle = (2 * Math.PI * k) / sides;
        const out = add(scale(ring.side, Math.cos(angle)), scale(other, Math.sin(angle)));
        const normal = add(scale(out, ring.shrunk), scale(ring.tangent, ring.lean));
        const index = this.vertex(add(ring.centre, scale(out, ring.radius * ring.shrunk)), normal, ring.colour, Math.cos(angle));
        if (k === 0) first = index;
      }
      if (before >= 0) this.band(before, first, sides);
      before = first;
    }
  }

  ball(centre, radius, colour) {
    const rows = 24;
    const sides = 36;
    let before = -1;
    for (let i = 0; i <= rows; i++) {
      const polar = (Math.PI * i) / rows;
      let first = -1;
      for (let k = 0; k <= sides; k++) {
        const angle = (2 * Math.PI * k) / sides;
        const normal = [Math.sin(polar) * Math.cos(angle), Math.sin(polar) * Math.sin(angle), Math.cos(polar)];
        const index = this.vertex(add(centre, scale(normal, radius)), normal, colour, -1);
        if (k === 0) first = index;
      }
      if (before >= 0) this.band(before, first, sides);
      before = first;
    }
  }
}

// The rings of a path: a curve through its nodes, and the stripe where the material directors of its edges are.
// nodes: points; path.radius and directors: by edge; colours: by node; parts: rings an edge.
function ringsOf(nodes, path, directors, colours, parts, smooth) {
  const edges = nodes.length - 1;
  const at = (k) => (path.closed ? nodes[((k % edges) + edges) % edges] : nodes[Math.min(Math.max(k, 0), edges)]);
  const radiusAt = (k) => {
    const before = k > 0 ? k - 1 : path.closed ? edges - 1 : 0;
    const after = k < edges ? k : path.closed ? 0 : edges - 1;
    return 0.5 * (path.radius[before] + path.radius[after]);
  };
  const rings = [];
  for (let i = 0; i <= edges * parts; i++) {
    const k = Math.min(Math.floor(i / parts), edges - 1);
    const s = i / parts - k;
    const [a, b] = [at(k), at(k + 1)];
    let centre = mix(a, b, s);
    if (smooth) {
      // A cubic from node to node whose slopes are those between the neighbours (Catmull and Rom 1974).
      const open = (end) => !path.closed && end;
      const ma = open(k === 0) ? subtract(b, a) : scale(subtract(b, at(k - 1)), 0.5);
      const mb = open(k === edges - 1) ? subtract(b, a) : scale(subtract(at(k + 2), a), 0.5);
      const r = 1 - s;
      centre = add(
        add(scale(a, (1 + 2 * s) * r * r), scale(b, s * s * (3 - 2 * s))),
        add(scale(ma, s * r * r), scale(mb, -s * s * r)),
      );
    }
    const radius = (1 - s) * radiusAt(k) + s * radiusAt(k + 1);
    rings.push({ centre, radius, colour: mix(colours[k], colours[k + 1], s) });
  }
  const last = rings.length - 1;
  rings.forEach((ring, i) => {
    const before = i > 0 ? i - 1 : path.closed ? last - 1 : 0;
    const after = i < last ? i + 1 : path.closed ? 1 : last;
    ring.tangent = unit(subtract(rings[after].centre, rings[before].centre));
  });
  // A frame without twist, and the directors' angles in it, continued from edge to edge.
  const plain = [across(rings[0].tangent)];
  for (let i = 1; i <= last; i++) plain.push(carried(plain[i - 1], rings[i - 1].tangent, rings[i].tangent));
  const angles = [];
  for (let e = 0; e < edges; e++) {
    const i = e * parts + (parts >> 1);
    const other = cross(rings[i].tangent, plain[i]);
    let angle = Math.atan2(dot(directors[e], other), dot(directors[e], plain[i]));
    if (e > 0) angle += 2 * Math.PI * Math.round((angles[e - 1] - angle) / (2 * Math.PI));
    angles.push(angle);
  }
  rings.forEach((ring, i) => {
    const place = Math.min(Math.max(i / parts - 0.5, 0), edges - 1);
    const e = Math.min(Math.floor(place), Math.max(edges - 2, 0));
    const next = Math.min(e + 1, edges - 1);
    const angle = angles[e] + (place - e) * (angles[next] - angles[e]);
    ring.side = add(scale(plain[i], Math.cos(angle)), scale(cross(ring.tangent, plain[i]), Math.sin(angle)));
  });
  return rings;
}
