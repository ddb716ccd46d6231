// Drawing of the viewer with WebGL 2: a lit mesh, its shadow on the floor, lines, and the camera.
"use strict";

const MESH_VERTEX = `#version 300 es
in vec3 position; in vec3 normal; in vec3 colour; in float stripe;
uniform mat4 view; uniform float floorHeight; uniform bool shadow;
out vec3 toned; out vec3 facing; out float around; out vec3 place;
void main() {
  place = shadow ? vec3(position.xy, floorHeight) : position;
  toned = colour; facing = normal; around = stripe;
  gl_Position = view * vec4(place, 1.0);
}`;

const MESH_FRAGMENT = `#version 300 es
precision highp float;
in vec3 toned; in vec3 facing; in float around; in vec3 place;
uniform vec3 eye; uniform bool shadow; uniform bool striped; uniform float opacity;
out vec4 shown;
void main() {
  if (shadow) { shown = vec4(0.865, 0.875, 0.89, 1.0); return; }
  vec3 n = normalize(facing), out_ = normalize(eye - place);
  if (dot(n, out_) < 0.0) n = -n;
  vec3 light = normalize(out_ + vec3(0.25, -0.15, 0.75));
  float soft = 0.5 + 0.5 * n.z, direct = max(dot(n, light), 0.0);
  float gloss = pow(max(dot(n, normalize(light + out_)), 0.0), 40.0);
  vec3 base = toned;
  if (striped) {
    float edge = fwidth(around) + 0.01;
    float bright = dot(base, vec3(0.3, 0.59, 0.11));
    base = mix(base, mix(vec3(0.98), vec3(0.15), smoothstep(0.5, 0.6, bright)), 0.85 * smoothstep(0.9 - edge, 0.9 + edge, around));
  }
  vec3 lit = base * (0.36 + 0.22 * soft + 0.5 * direct) + 0.18 * gloss;
  float rim = opacity < 1.0 ? pow(1.0 - abs(dot(n, out_)), 2.0) : 0.0;
  shown = vec4(lit, mix(opacity, 0.75, rim));
}`;

const LINE_VERTEX = `#version 300 es
in vec3 position; uniform mat4 view;
void main() { gl_Position = view * vec4(position, 1.0); }`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 tone; out vec4 shown;
void main() { shown = tone; }`;

class Canvas {
  constructor(element) {
    const gl = element.getContext("webgl2", { antialias: true, alpha: false });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.element = element;
    this.gl = gl;
    this.meshProgram = this.program(MESH_VERTEX, MESH_FRAGMENT, ["position", "normal", "colour", "stripe"]);
    this.lineProgram = this.program(LINE_VERTEX, LINE_FRAGMENT, ["position"]);
    this.vertexBuffer = gl.createBuffer();
    this.indexBuffer = gl.createBuffer();
    this.lineBuffer = gl.createBuffer();
  }

  program(vertex, fragment, attributes) {
    const gl = this.gl;
    const made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    attributes.forEach((name, k) => gl.bindAttribLocation(made, k, name));
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return made;
  }

  // Begin a picture seen by a camera {eye, view}.
  begin(camera) {
    const gl = this.gl;
    this.camera = camera;
    gl.viewport(0, 0, this.element.width, this.element.height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  mesh(mesh, { shadow = false, floor = 0, striped = false, opacity = 1 }) {
    const gl = this.gl;
    const program = this.meshProgram;
    gl.useProgram(program);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.vertexBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, mesh.vertices.subarray(0, mesh.used), gl.DYNAMIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indexBuffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.indices.subarray(0, mesh.count), gl.DYNAMIC_DRAW);
    let offset = 0;
    [3, 3, 3, 1].forEach((size, k) => {
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, size, gl.FLOAT, false, 40, offset);
      offset += 4 * size;
    });
    const at = (name) => gl.getUniformLocation(program, name);
    gl.uniformMatrix4fv(at("view"), false, this.camera.view);
    gl.uniform3fv(at("eye"), this.camera.eye);
    gl.uniform1f(at("floorHeight"), floor);
    gl.uniform1i(at("shadow"), shadow ? 1 : 0);
    gl.uniform1i(at("striped"), striped ? 1 : 0);
    gl.uniform1f(at("opacity"), opacity);
    if (opacity < 1) {
      // The far side first, then the near one, over what is behind.
      gl.enable(gl.BLEND);
      gl.enable(gl.CULL_FACE);
      gl.depthMask(false);
      for (const side of [gl.FRONT, gl.BACK]) {
        gl.cullFace(side);
        gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
      }
      gl.depthMask(true);
      gl.disable(gl.CULL_FACE);
      gl.disable(gl.BLEND);
    } else {
      gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
    }
  }

  lines(points, tone, strip = false) {
    const gl = this.gl;
    gl.useProgram(this.lineProgram);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points.flat()), gl.DYNAMIC_DRAW);
    for (let k = 1; k < 4; k++) gl.disableVertexAttribArray(k);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    gl.uniformMatrix4fv(gl.getUniformLocation(this.lineProgram, "view"), false, this.camera.view);
    gl.uniform4fv(gl.getUniformLocation(this.lineProgram, "tone"), tone);
    gl.enable(gl.BLEND);
    gl.drawArrays(strip ? gl.LINE_STRIP : gl.LINES, 0, points.length);
    gl.disable(gl.BLEND);
  }
}

// A camera that looks at a target from a direction {yaw, pitch} and a distance, with z upwards.
function cameraAt(target, { yaw, pitch, distance }, aspect) {
  const out = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
  const eye = add(target, scale(out, distance));
  const right = unit(cross([0, 0, 1], out));
  const up = cross(out, right);
  const f = 1 / Math.tan((Math.PI / 180) * 15);
  const [near, far] = [0.02 * distance, 50 * distance];
  const sx = f / Math.max(aspect, 0.01);
  const a = (far + near) / (near - far);
  const b = (2 * far * near) / (near - far);
  const row = (v) => [...v, -dot(v, eye)];
  const [r, u, o] = [row(right), row(up), row(out)];
  const view = new Float32Array(16);
  for (let k = 0; k < 4; k++) {
    view[4 * k] = sx * r[k];
    view[4 * k + 1] = f * u[k];
    view[4 * k + 2] = a * o[k] + (k === 3 ? b : 0);
    view[4 * k + 3] = -o[k];
  }
  return { eye, view, right, up };
}
