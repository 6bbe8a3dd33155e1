"""The script of a 3D view that mouse, touch and keys turn: coloured triangles by WebGL, nothing from elsewhere.

It reads the JSON of element ``#shapes``: ``low`` and ``high`` corner of what is seen in metres, z up; ``modes``, the
names of what may be shown; and ``sets``, each with a ``colour`` (r, g, b), its ``modes``, and either ``voxels``
(base64 of three bytes a voxel, its indices), with ``origin`` and ``side`` in metres, or ``boxes``: eight corners
(corner 4 i + 2 j + k), opacity (0 = edges alone, opaque), and width of the edges in metres.
"""

from __future__ import annotations

ORBIT = """
(() => {
const shapes = JSON.parse(document.getElementById("shapes").textContent), canvas = document.getElementById("orbit");
const gl = canvas.getContext("webgl", { antialias: true, alpha: true });
if (!gl) { document.getElementById("orbit-failed").hidden = false; canvas.hidden = true; return; }
const compile = (kind, text) => {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, text); gl.compileShader(shader);
  return shader;
};
const program = gl.createProgram();
gl.attachShader(program, compile(gl.VERTEX_SHADER, `attribute vec3 at; attribute vec4 ink; uniform mat4 view;
  varying vec4 colour; void main() { gl_Position = view * vec4(at, 1.0); colour = ink; }`));
gl.attachShader(program, compile(gl.FRAGMENT_SHADER, `precision mediump float; varying vec4 colour;
  void main() { gl_FragColor = vec4(colour.rgb * colour.a, colour.a); }`));
gl.linkProgram(program); gl.useProgram(program);
const SHADE = [0.78, 0.9, 1], CORNERS = [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]];
const middle = shapes.low.map((a, k) => (a + shapes.high[k]) / 2);
const reach = Math.hypot(...shapes.high.map((b, k) => b - shapes.low[k])) / 2;
const eye = { azimuth: -2.5, elevation: 0.75, zoom: 1 };
let mode = shapes.modes[0], solid = null, glass = null;

const quad = (out, corner, u, v, colour, shade, alpha) => {
  for (const [a, b] of CORNERS) {
    for (let k = 0; k < 3; k++) out.push(corner[k] + a * u[k] + b * v[k]);
    out.push(colour[0] / 255 * shade, colour[1] / 255 * shade, colour[2] / 255 * shade, alpha);
  }
};
const block = (out, corner, sides, colour, alpha, open) => {
  for (let axis = 0; axis < 3; axis++) for (let end = 0; end < 2; end++) if (!open || open(axis, end)) {
    const from = corner.map((c, k) => c + end * sides[axis][k]);
    const light = axis === 2 && !end ? 0.6 : SHADE[axis];
    quad(out, from, sides[(axis + 1) % 3], sides[(axis + 2) % 3], colour, light, alpha);
  }
};
const key = (x, y, z) => (z * 256 + y) * 256 + x;
const decoded = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
for (const set of shapes.sets) if (set.voxels !== undefined) set.cells = decoded(set.voxels);

const build = () => {
  const opaque = [], clear = [], taken = new Set();
  const shown = shapes.sets.filter(set => set.on && (!set.modes.length || set.modes.includes(mode)));
  const cells = (set, each) => {
    for (let k = 0; set.cells && k < set.cells.length; k += 3) each(set.cells[k], set.cells[k + 1], set.cells[k + 2]);
  };
  for (const set of shown) cells(set, (x, y, z) => taken.add(key(x, y, z)));
  for (const set of shown) {
    const s = set.side, sides = [[s, 0, 0], [0, s, 0], [0, 0, s]];
    cells(set, (x, y, z) => block(opaque, set.origin.map((o, k) => o + s * [x, y, z][k]), sides, set.colour, 1,
      (axis, end) => {
        const n = [x, y, z];
        n[axis] += end ? 1 : -1;
        return n[axis] < 0 || !taken.has(key(...n));
      }));
    for (const { corners, opacity, edge } of set.boxes || []) {
      const less = (a, b) => a.map((c, k) => c - b[k]);
      const sides = [4, 2, 1].map(k => less(corners[k], corners[0]));
      const units = sides.map(side => side.map(c => c / (Math.hypot(...side) || 1)));
      if (opacity > 0) block(clear, corners[0], sides, set.colour, 0.35 * opacity);
      for (let axis = 0; axis < 3; axis++) for (let k = 0; k < 4; k++) {
        const [b, c] = [(axis + 1) % 3, (axis + 2) % 3], from = [0, 1, 2].map(m =>
          corners[0][m] + (k & 1) * sides[b][m] + (k >> 1) * sides[c][m] - edge / 2 * (units[b][m] + units[c][m]));
        const beam = [];
        beam[axis] = sides[axis];
        for (const other of [b, c]) beam[other] = units[other].map(x => x * edge);
        block(opacity > 0 ? clear : opaque, from, beam, set.colour, opacity || 1);
      }
    }
  }
  const upload = floats => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(floats), gl.STATIC_DRAW);
    return { buffer, count: floats.length / 7 };
  };
  for (const old of [solid, glass]) if (old) gl.deleteBuffer(old.buffer);
  solid = upload(opaque); glass = upload(clear);
  canvas.dataset.triangles = (solid.count + glass.count) / 3;
};

const matrix = () => {
  const [ca, sa, ce, se] = [Math.cos(eye.azimuth), Math.sin(eye.azimuth), Math.cos(eye.elevation),
    Math.sin(eye.elevation)];
  const right = [-sa, ca, 0], up = [-se * ca, -se * sa, ce], back = [ce * ca, ce * sa, se];
  const aspect = canvas.width / canvas.height, narrow = Math.min(1, aspect);
  const size = eye.zoom * narrow / reach * 1.35, depth = 0.5 / reach;
  const rows = [right.map(c => c * size / aspect), up.map(c => c * size), back.map(c => -c * depth)];
  const shift = rows.map(row => -row.reduce((sum, c, k) => sum + c * middle[k], 0));
  return new Float32Array([0, 1, 2].flatMap(k => [rows[0][k], rows[1][k], rows[2][k], 0]).concat(shift, 1));
};
const draw = () => {
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  gl.viewport(0, 0, canvas.width, canvas.height);
  gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.uniformMatrix4fv(gl.getUniformLocation(program, "view"), false, matrix());
  const put = ({ buffer, count }) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    for (const [name, size, offset] of [["at", 3, 0], ["ink", 4, 12]]) {
      const place = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 28, offset);
    }
    gl.drawArrays(gl.TRIANGLES, 0, count);
  };
  gl.enable(gl.DEPTH_TEST); gl.disable(gl.BLEND); gl.depthMask(true); put(solid);
  gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA); gl.depthMask(false); put(glass);
  gl.depthMask(true);
};
let due = false;
const redraw = () => { if (!due) { due = true; requestAnimationFrame(() => { due = false; draw(); }); } };
const turn = (across, down) => {
  eye.azimuth -= across;
  eye.elevation = Math.min(Math.PI / 2, Math.max(-0.2, eye.elevation + down));
  redraw();
};
const zoom = factor => { eye.zoom = Math.min(12, Math.max(0.4, eye.zoom * factor)); redraw(); };

const fingers = new Map();
const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.x - b.x, a.y - b.y) || 1; };
canvas.addEventListener("pointerdown", e => {
  canvas.setPointerCapture(e.pointerId); canvas.focus({ preventScroll: true });
  fingers.set(e.pointerId, { x: e.clientX, y: e.clientY });
});
canvas.addEventListener("pointermove", e => {
  const last = fingers.get(e.pointerId);
  if (!last) return;
  const before = fingers.size === 2 ? spread() : 0;
  fingers.set(e.pointerId, { x: e.clientX, y: e.clientY });
  if (fingers.size === 2) zoom(spread() / before);
  else turn((e.clientX - last.x) * 0.008, (e.clientY - last.y) * 0.008);
});
for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, e => fingers.delete(e.pointerId));
canvas.addEventListener("wheel", e => {
  if (document.activeElement !== canvas) return; // until it is clicked, the page scrolls
  e.preventDefault(); zoom(Math.exp(-e.deltaY * 0.0015));
}, { passive: false });
const keys = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
canvas.addEventListener("keydown", e => {
  if (keys[e.key]) turn(...keys[e.key]);
  else if (e.key === "+" || e.key === "=") zoom(1.15);
  else if (e.key === "-") zoom(1 / 1.15);
  else return;
  e.preventDefault();
});
for (const input of document.querySelectorAll("input[name=mode]")) input.addEventListener("change", () => {
  mode = input.value; build(); redraw();
});
for (const input of document.querySelectorAll("input[data-set]")) {
  shapes.sets[input.dataset.set].on = input.checked;
  input.addEventListener("change", () => { shapes.sets[input.dataset.set].on = input.checked; build(); redraw(); });
}
new ResizeObserver(redraw).observe(canvas);
build(); redraw();
})();
"""
"""Of a page with the elements ``#shapes``, ``#orbit`` (a canvas), ``#orbit-failed``, and the inputs that choose."""
