// The viewer of a run: reads the film, draws the frame that is chosen, and lets a person choose.
"use strict";

const VIRIDIS = ["#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"];
const SIGNED = ["#08519c", "#4a90c9", "#a6cbe3", "#e6e6e6", "#f4b48c", "#dd6a42", "#a1260e"];
const NEARNESS = ["#a1260e", "#dd6a42", "#f4b48c", "#d9d9d9", "#cfcfcf"];
const TYPES = { "<f8": Float64Array, "<f4": Float32Array, "<i2": Int16Array, "|i1": Int8Array, "|u1": Uint8Array };

const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);

function toneOf(stops, share) {
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const k = Math.min(Math.floor(place), stops.length - 2);
  return mix(stops[k], stops[k + 1], place - k);
}

// A number with the prefix it reads best with: 2.8 mm/s.
function shown(value, unitName) {
  const size = Math.abs(value);
  const steps = [[1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"], [1e-15, "f"]];
  if (size === 0) return `0 ${unitName}`;
  const [step, prefix] = steps.find(([least]) => size >= 0.9999 * least) || steps[steps.length - 1];
  return `${parseFloat((value / step).toPrecision(3))} ${prefix}${unitName}`;
}

class Viewer {
  constructor(root, film, bytes, options) {
    this.film = film;
    this.arrays = {};
    for (const [name, place] of Object.entries(film.arrays)) this.arrays[name] = this.array(bytes, place);
    for (const field of film.fields) field.values = this.array(bytes, field.array);
    for (const path of film.paths) {
      path.closed = path.nodes[0] === path.nodes[path.nodes.length - 1];
      path.tone = rgb(path.colour);
    }
    const [low, high] = film.box;
    const extent = Math.max(...this.extentOfFrame(0));
    this.length = extent || 1; // lengths are drawn over this one
    this.low = scale(low, 1 / this.length);
    this.high = scale(high, 1 / this.length);
    this.frame = 0;
    this.playing = false;
    this.mesh = new Mesh();
    this.glass = new Mesh();
    this.build(root, options);
    this.canvas = new Canvas(root.querySelector("canvas"));
    this.reset();
    new ResizeObserver(() => this.draw()).observe(this.canvas.element);
    this.draw();
    if (options.play) this.play(true);
  }

  array(bytes, { at, count, type }) {
    return new TYPES[type](bytes.buffer, bytes.byteOffset + at, count);
  }

  extentOfFrame(frame) {
    const n = this.film.nodes;
    const values = this.arrays.nodes.subarray(3 * n * frame, 3 * n * (frame + 1));
    return [0, 1, 2].map((axis) => {
      let [low, high] = [Infinity, -Infinity];
      for (let k = axis; k < 3 * n; k += 3) {
        low = Math.min(low, values[k]);
        high = Math.max(high, values[k]);
      }
      return (high - low) * this.film.unit;
    });
  }

  build(root, options) {
    const fields = this.film.fields.map((field) => `<option value="${field.name}">${field.name}</option>`).join("");
    const check = (name, words, on) => `<label><input type="checkbox" class="${name}" ${on ? "checked" : ""}>${words}</label>`;
    root.innerHTML = `<canvas></canvas>
      <div class="title"><b class="name"></b><div class="facts"></div></div>
      <div class="colours"><label>colour <select class="field"><option value="filament">filament</option>${fields}</select></label>
        <div class="scale"><div class="bar"></div><div class="ends"><span></span><span></span></div><div class="what"></div></div></div>
      <div class="controls"><div class="row"><button class="play" title="space">play</button>
        <input class="time" type="range" min="0" max="${this.film.frames - 1}" value="0" step="1" aria-label="time"><span class="now"></span></div>
        <div class="row small"><label>speed <select class="speed">${[0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50].map((s) => `<option value="${s}">${s}×</option>`).join("")}</select></label>
        ${check("follow", "follow", options.follow)}${check("stripe", "twist stripe", true)}${this.film.swims ? check("path", "path", true) : ""}${check("floor", "floor", true)}${check("smooth", "smooth", true)}
        <span>view <button class="from" data-from="x">x</button> <button class="from" data-from="y">y</button> <button class="from" data-from="z">z</button> <button class="reset">reset</button></span>
        <span class="keys">drag to turn, scroll to zoom, shift and drag to shift</span></div></div>`;
    this.find = (name) => root.querySelector(`.${name}`);
    this.find("name").textContent = this.film.name;
    const thinned = this.film.all_frames > this.film.frames ? ` of ${this.film.all_frames}` : "";
    this.facts = `${this.film.nodes} nodes, ${this.film.frames}${thinned} frames`;
    const time = this.arrays.time;
    const span = time[time.length - 1] - time[0];
    const speeds = [...this.find("speed").options].map((option) => Number(option.value));
    this.find("speed").value = speeds.reduce((best, s) => (Math.abs(Math.log(span / s / 20)) < Math.abs(Math.log(span / best / 20)) ? s : best));
    this.find("field").value = this.film.fields.some((f) => f.name === options.colour) ? options.colour : "filament";
    for (const name of ["follow", "stripe", "path", "floor", "smooth", "field"]) this.find(name)?.addEventListener("change", () => this.draw());
    this.find("time").addEventListener("input", (event) => this.show(Number(event.target.value)));
    this.find("play").addEventListener("click", () => this.play(!this.playing));
    this.find("reset").addEventListener("click", () => this.reset(true));
    for (const button of root.querySelectorAll(".from")) button.addEventListener("click", () => this.lookFrom(button.dataset.from));
    root.tabIndex = 0;
    root.style.outline = "none";
    root.addEventListener("keydown", (event) => this.key(event));
    this.handle(root.querySelector("canvas"));
  }

  key(event) {
    if (event.target.matches("select, input:not(.time)")) return;
    const moves = { ArrowRight: 1, ArrowLeft: -1, PageUp: 10, PageDown: -10, Home: -Infinity, End: Infinity };
    if (event.key === " " && !event.target.matches("button")) this.play(!this.playing);
    else if (event.key in moves) this.show(this.frame + moves[event.key]);
    else return;
    event.preventDefault();
  }

  handle(element) {
    const fingers = new Map();
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, event);
    });
    for (const kind of ["pointerup", "pointercancel"]) element.addEventListener(kind, (event) => fingers.delete(event.pointerId));
    element.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
      if (fingers.size === 2) {
        const other = [...fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
        const apart = (finger) => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY) || 1;
        this.angle.distance *= apart(before) / apart(event);
      } else if (event.shiftKey || event.buttons & 6) {
        const step = (0.54 * this.angle.distance) / element.clientHeight;
        const { right, up } = cameraAt(this.target, this.angle, 1);
        this.shift = add(this.shift, add(scale(right, -dx * step), scale(up, dy * step)));
      } else {
        this.angle.yaw -= 0.008 * dx;
        this.angle.pitch = Math.min(Math.max(this.angle.pitch + 0.008 * dy, -1.57), 1.57);
      }
      fingers.set(event.pointerId, event);
      this.draw();
    });
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.angle.distance *= Math.exp(Math.min(Math.max(event.deltaY, -100), 100) * 0.0015);
      this.draw();
    }, { passive: false });
  }

  lookFrom(axis) {
    Object.assign(this.angle, { x: { yaw: 0, pitch: 0 }, y: { yaw: -Math.PI / 2, pitch: 0 }, z: { yaw: -Math.PI / 2, pitch: 1.57 } }[axis]);
    this.draw();
  }

  // Look from a little above at all that ever moves, or at the swimmer alone where the camera follows it.
  reset(redraw = false) {
    this.angle = { yaw: -1.1, pitch: 0.42, distance: 1 };
    this.shift = [0, 0, 0];
    this.angle.distance = 2.35 * (this.find("follow").checked ? 1.15 : Math.max(...subtract(this.high, this.low), 1.15));
    if (redraw) this.draw();
  }

  point(name, frame) {
    return scale([...this.arrays[name].subarray(3 * frame, 3 * frame + 3)], 1 / this.length);
  }

  show(frame) {
    this.frame = Math.min(Math.max(frame, 0), this.film.frames - 1);
    this.draw();
  }

  play(on) {
    this.playing = on && this.film.frames > 1;
    this.find("play").textContent = this.playing ? "pause" : "play";
    if (!this.playing) return;
    const time = this.arrays.time;
    if (this.frame === this.film.frames - 1) this.frame = 0;
    let [now, before, drawn] = [time[this.frame], performance.now(), this.frame];
    const tick = (instant) => {
      if (!this.playing) return;
      now += (Number(this.find("speed").value) * (instant - before)) / 1000;
      before = instant;
      if (this.frame !== drawn) now = time[this.frame]; // a person has moved the slider
      let next = this.frame;
      while (next < this.film.frames - 1 && time[next + 1] <= now) next++;
      if (next !== this.frame) this.show(next);
      drawn = next;
      if (next === this.film.frames - 1) return this.play(false);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  // The colour of every node of a path, between those of its edges where the field is one of edges.
  coloursOf(path, field, stops) {
    if (!field || !path.wet) return path.nodes.map(() => path.tone);
    const row = field.values.subarray(field.count * this.frame, field.count * (this.frame + 1));
    const share = (k) => row[k] / 255;
    if (field.of === "nodes") return path.nodes.map((node) => toneOf(stops, share(node)));
    const last = path.edges.length - 1;
    return path.nodes.map((_, k) => toneOf(stops, 0.5 * (share(path.edges[Math.max(k - 1, 0)]) + share(path.edges[Math.min(k, last)]))));
  }

  assemble() {
    const { nodes: N, edges: E, unit: step } = this.film;
    const centre = this.point("centre", this.frame);
    const positions = this.arrays.nodes.subarray(3 * N * this.frame, 3 * N * (this.frame + 1));
    const directors = this.arrays.directors.subarray(3 * E * this.frame, 3 * E * (this.frame + 1));
    const place = (k) => add(centre, scale([...positions.subarray(3 * k, 3 * k + 3)], step / this.length));
    const field = this.film.fields.find((candidate) => candidate.name === this.find("field").value);
    const stops = field && this.stopsOf(field);
    const fine = N < 1500;
    const smooth = this.find("smooth").checked;
    this.mesh.clear();
    this.glass.clear();
    for (const path of this.film.paths) {
      const along = path.edges.map((edge) => [...directors.subarray(3 * edge, 3 * edge + 3)]);
      const thin = { ...path, radius: path.radius.map((radius) => radius / this.length) };
      const parts = path.wet && fine ? 4 : 1;
      const rings = ringsOf(path.nodes.map(place), thin, along, this.coloursOf(path, field, stops), parts, smooth && path.wet);
      this.mesh.tube(rings, fine ? 20 : 8, path.closed);
    }
    for (const ball of this.film.balls) {
      const glassy = ball.kind === "head";
      (glassy ? this.glass : this.mesh).ball(place(ball.node), ball.radius / this.length, glassy ? [0.62, 0.66, 0.72] : [0.25, 0.25, 0.27]);
    }
  }

  stopsOf(field) {
    return (field.signed ? SIGNED : field.name === "contact" ? NEARNESS : VIRIDIS).map(rgb);
  }

  // Lines of the floor below everything that ever moves, a round length apart.
  floorLines() {
    const margin = 0.25;
    const height = this.low[2] - 0.04 * Math.max(...subtract(this.high, this.low));
    const target = (0.1 * this.length);
    const power = 10 ** Math.floor(Math.log10(target));
    const spacing = [1, 2, 5, 10].map((k) => k * power).find((candidate) => candidate >= 0.999 * target);
    const step = spacing / this.length;
    const [x0, y0] = [0, 1].map((k) => Math.floor((this.low[k] - margin) / step));
    const [x1, y1] = [0, 1].map((k) => Math.ceil((this.high[k] + margin) / step));
    const points = [];
    for (let i = x0; i <= x1; i++) points.push([i * step, y0 * step, height], [i * step, y1 * step, height]);
    for (let j = y0; j <= y1; j++) points.push([x0 * step, j * step, height], [x1 * step, j * step, height]);
    return { points, height, spacing };
  }

  draw() {
    const element = this.canvas.element;
    const sharpness = Math.min(window.devicePixelRatio || 1, 2);
    element.width = Math.max(1, Math.round(element.clientWidth * sharpness));
    element.height = Math.max(1, Math.round(element.clientHeight * sharpness));
    this.assemble();
    const followed = this.find("follow").checked;
    const middle = scale(add(this.low, this.high), 0.5);
    this.target = add(followed ? this.point("centre", this.frame) : middle, this.shift);
    const aspect = element.width / element.height;
    this.canvas.begin(cameraAt(this.target, { ...this.angle, distance: this.angle.distance * Math.max(1, 1.15 / aspect) }, aspect));
    const floor = this.floorLines();
    if (this.find("floor").checked) {
      this.canvas.lines(floor.points, [0.55, 0.6, 0.68, 0.28]);
      this.canvas.mesh(this.mesh, { shadow: true, floor: floor.height });
      if (this.glass.count) this.canvas.mesh(this.glass, { shadow: true, floor: floor.height });
    }
    this.canvas.mesh(this.mesh, { striped: this.find("stripe").checked });
    if (this.find("path")?.checked && this.frame > 0) {
      const way = [];
      for (let k = 0; k <= this.frame; k++) way.push(this.point("follow", k));
      this.canvas.lines(way, [0.85, 0.37, 0, 0.9], true);
    }
    if (this.glass.count) this.canvas.mesh(this.glass, { opacity: 0.32 });
    this.say(floor.spacing);
  }

  say(spacing) {
    this.find("time").value = this.frame;
    this.find("now").textContent = `${parseFloat(this.arrays.time[this.frame].toPrecision(4))} s`;
    this.find("facts").textContent = this.facts + (this.find("floor").checked ? `; squares of ${shown(spacing, "m")}` : "");
    const field = this.film.fields.find((candidate) => candidate.name === this.find("field").value);
    this.find("scale").style.display = field ? "" : "none";
    if (!field) return;
    const stops = this.stopsOf(field).map((tone) => `rgb(${tone.map((c) => Math.round(255 * c)).join()})`);
    this.find("bar").style.background = `linear-gradient(to right, ${stops.join()})`;
    const ends = this.find("ends").children;
    ends[0].textContent = shown(field.low, field.unit);
    ends[1].textContent = shown(field.high, field.unit);
    this.find("what").textContent = field.label;
  }
}

function startViewer(root, film, text, options) {
  try {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    for (const field of film.fields) field.count = field.array.count / film.frames;
    return new Viewer(root, film, bytes, options);
  } catch (error) {
    root.innerHTML = `<div class="failed"></div>`;
    root.firstChild.textContent = `The run cannot be shown: ${error.message}`;
    throw error;
  }
}
