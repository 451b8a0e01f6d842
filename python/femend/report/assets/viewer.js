// Orbit viewer of the mesh on a 2-D canvas: no WebGL, so it opens everywhere, on paper and on machines without a GPU.
(function () {
  "use strict";
  const source = document.getElementById("mesh-data");
  const canvas = document.getElementById("mesh-canvas");
  const box = document.getElementById("mesh-box");
  const tip = document.getElementById("mesh-tip");
  if (!source || !canvas || !canvas.getContext) return;
  const data = JSON.parse(source.textContent);
  const pen = canvas.getContext("2d");
  const n = data.ids.length;
  const upY = data.view.up === "Y";

  // Turntable coordinates: Z up, middle at the origin, diagonal one.
  const points = new Float64Array(3 * n);
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const turned = (x, y, z) => (upY ? [x, -z, y] : [x, y, z]);
  for (let i = 0; i < n; i++) {
    const p = turned(data.xyz[3 * i], data.xyz[3 * i + 1], data.xyz[3 * i + 2]);
    for (let k = 0; k < 3; k++) {
      points[3 * i + k] = p[k];
      low[k] = Math.min(low[k], p[k]);
      high[k] = Math.max(high[k], p[k]);
    }
  }
  const middle = low.map((v, k) => (v + high[k]) / 2);
  const diagonal = Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]) || 1;
  for (let i = 0; i < 3 * n; i++) points[i] = (points[i] - middle[i % 3]) / diagonal;
  for (const key of ["sensors", "shakers"]) for (const m of data[key]) m.v = turned(m.vector[0], m.vector[1], m.vector[2]);
  for (const direction of [data.direction, ...data.further.map((place) => place.direction)])
    if (direction) direction.v = turned(...direction.vector);
  const faces = [];
  for (let i = 0; i < data.faces.length; i += 4) faces.push([...new Set(data.faces.slice(i, i + 4))]);
  const onLines = n > 1500 ? [] : [...new Set(data.lines)];

  const view = { azimuth: 0, elevation: 0, zoom: 1, x: 0, y: 0 };
  const eye = new Float64Array(3 * n);
  let width = 0, height = 0, scale = 1, basis = null, colours = {}, hovered = -1, wanted = false;

  function reset() {
    view.azimuth = data.view.azimuth; view.elevation = data.view.elevation;
    view.zoom = 1; view.x = 0; view.y = 0;
    redraw();
  }

  function readColours() {
    const style = getComputedStyle(document.documentElement);
    for (const name of ["ink", "soft", "line", "paper", "panel", "measured", "nominal", "parameters", "final", "place", "alike", "face", "edge"])
      colours[name] = style.getPropertyValue("--" + name).trim();
  }

  function project(x, y, z) {
    const b = basis;
    return [
      width / 2 + view.x + scale * (b[0] * x + b[1] * y),
      height / 2 + view.y - scale * (b[2] * x + b[3] * y + b[4] * z),
      b[5] * x + b[6] * y + b[7] * z,
    ];
  }

  // The zoom that fits the mesh into the box from the present angle.
  function fit() {
    let w = 1e-9, h = 1e-9;
    for (let i = 0; i < n; i++) {
      const x = points[3 * i], y = points[3 * i + 1], z = points[3 * i + 2];
      w = Math.max(w, Math.abs(basis[0] * x + basis[1] * y));
      h = Math.max(h, Math.abs(basis[2] * x + basis[3] * y + basis[4] * z));
    }
    return Math.min((width / 2 - 80) / w, (height / 2 - 70) / h, 3 * Math.max(width, height));
  }

  function turn() {
    const a = view.azimuth * Math.PI / 180, e = view.elevation * Math.PI / 180;
    const ca = Math.cos(a), sa = Math.sin(a), ce = Math.cos(e), se = Math.sin(e);
    basis = [ca, -sa, sa * se, ca * se, ce, -sa * ce, -ca * ce, se];
  }

  let fitted = 1;
  function refit() { turn(); fitted = Math.max(fit(), 1); }

  function draw() {
    wanted = false;
    turn();
    scale = fitted * view.zoom;
    for (let i = 0; i < n; i++) {
      const p = project(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
      eye[3 * i] = p[0]; eye[3 * i + 1] = p[1]; eye[3 * i + 2] = p[2];
    }
    pen.clearRect(0, 0, width, height);
    drawFaces(); drawLines(); drawSupports(); drawMarkers(); drawPlaces(); drawAxes();
  }

  // A page in the background gets no frames; it is drawn all the same, for prints and pictures of it.
  function redraw() {
    if (wanted) return;
    wanted = true;
    requestAnimationFrame(() => wanted && draw());
    setTimeout(() => wanted && draw(), 100);
  }

  // Faces far to near, lighter where they face the viewer.
  function drawFaces() {
    const depth = faces.map((f) => f.reduce((sum, k) => sum + eye[3 * k + 2], 0) / f.length);
    const order = faces.map((_, k) => k).sort((a, b) => depth[a] - depth[b]);
    pen.lineWidth = faces.length > 3000 ? 0.4 : 0.8; pen.lineJoin = "round";
    for (const k of order) {
      const f = faces[k];
      pen.beginPath();
      f.forEach((q, j) => (j ? pen.lineTo(eye[3 * q], eye[3 * q + 1]) : pen.moveTo(eye[3 * q], eye[3 * q + 1])));
      pen.closePath();
      pen.fillStyle = colours.face; pen.fill();
      pen.globalAlpha = 0.22 * (1 - facing(f)); pen.fillStyle = colours.soft; pen.fill(); pen.globalAlpha = 1;
      pen.strokeStyle = colours.edge; pen.stroke();
    }
  }

  // Cosine between the normal of a face and the line of sight, 0 to 1.
  function facing(f) {
    const p = 3 * f[0], q = 3 * f[1], r = 3 * f[2];
    const ux = eye[q] - eye[p], uy = eye[q + 1] - eye[p + 1], uz = scale * (eye[q + 2] - eye[p + 2]);
    const vx = eye[r] - eye[p], vy = eye[r + 1] - eye[p + 1], vz = scale * (eye[r + 2] - eye[p + 2]);
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    return Math.abs(nz) / (Math.hypot(nx, ny, nz) || 1);
  }

  function drawLines() {
    pen.beginPath();
    for (let i = 0; i < data.lines.length; i += 2) {
      const a = 3 * data.lines[i], b = 3 * data.lines[i + 1];
      pen.moveTo(eye[a], eye[a + 1]); pen.lineTo(eye[b], eye[b + 1]);
    }
    pen.strokeStyle = colours.soft; pen.lineWidth = 3; pen.lineCap = "round"; pen.stroke();
    pen.fillStyle = colours.ink;
    for (const i of onLines) disc(eye[3 * i], eye[3 * i + 1], 1.8, true);
  }

  function disc(x, y, r, fill) { pen.beginPath(); pen.arc(x, y, r, 0, 7); if (fill) pen.fill(); else pen.stroke(); }

  function drawSupports() {
    pen.strokeStyle = colours.ink; pen.lineWidth = 1.3; pen.fillStyle = colours.paper;
    for (const k of data.supports.length > 200 ? [] : data.supports) {
      const x = eye[3 * k], y = eye[3 * k + 1];
      pen.beginPath(); pen.moveTo(x, y); pen.lineTo(x + 7, y + 12); pen.lineTo(x - 7, y + 12); pen.closePath();
      pen.fill(); pen.stroke();
    }
  }

  function arrow(node, v, length, colour, thick, tail) {
    const i = 3 * node, x = points[i], y = points[i + 1], z = points[i + 2], s = length / scale;
    const from = project(x + tail * s * v[0], y + tail * s * v[1], z + tail * s * v[2]);
    const to = project(x + (1 + tail) * s * v[0], y + (1 + tail) * s * v[1], z + (1 + tail) * s * v[2]);
    const dx = to[0] - from[0], dy = to[1] - from[1], l = Math.hypot(dx, dy);
    pen.strokeStyle = pen.fillStyle = colour; pen.lineWidth = thick;
    if (l < 4) { disc(from[0], from[1], 3 + thick, false); return to; }
    const ux = dx / l, uy = dy / l, h = 4 + 2 * thick;
    pen.beginPath(); pen.moveTo(from[0], from[1]); pen.lineTo(to[0] - 0.7 * h * ux, to[1] - 0.7 * h * uy); pen.stroke();
    pen.beginPath(); pen.moveTo(to[0], to[1]);
    pen.lineTo(to[0] - h * ux + 0.45 * h * uy, to[1] - h * uy - 0.45 * h * ux);
    pen.lineTo(to[0] - h * ux - 0.45 * h * uy, to[1] - h * uy + 0.45 * h * ux);
    pen.closePath(); pen.fill();
    return to;
  }

  function drawMarkers() {
    for (const m of data.sensors) arrow(m.node, m.v, 34, colours.parameters, 2, 0);
    for (const m of data.shakers) {  // the force arrow points at the node, as forces are drawn
      const to = arrow(m.node, m.v, 52, colours.nominal, 4, -1.12);
      if (data.shakers.length < 4) label("shaker", to[0] + 8, to[1] + 22, colours.nominal, false);
    }
  }

  function label(words, x, y, colour, bold) {
    pen.font = (bold ? "600 14px " : "12px ") + "system-ui, sans-serif";
    pen.lineWidth = 4; pen.lineJoin = "round"; pen.strokeStyle = colours.panel; pen.strokeText(words, x, y);
    pen.fillStyle = colour; pen.fillText(words, x, y);
  }

  function drawPlace(at, direction) {
    pen.strokeStyle = colours.place;
    if (at.length === 2) {
      pen.lineWidth = 4; pen.setLineDash([6, 5]); pen.beginPath();
      pen.moveTo(eye[3 * at[0]], eye[3 * at[0] + 1]); pen.lineTo(eye[3 * at[1]], eye[3 * at[1] + 1]);
      pen.stroke(); pen.setLineDash([]);
    }
    for (const k of at) {
      const x = eye[3 * k], y = eye[3 * k + 1];
      if (at.length > 3) {  // an area: dots, so that it stays to be seen through
        pen.fillStyle = colours.place; disc(x, y, 5.5, true);
        continue;
      }
      pen.globalAlpha = 0.2; pen.fillStyle = colours.place; disc(x, y, 17, true); pen.globalAlpha = 1;
      disc(x, y, 5.5, true);
      pen.lineWidth = 2.5; pen.strokeStyle = colours.place; disc(x, y, 11, false);
      if (direction && !direction.rotation) {
        const v = direction.v, back = v.map((c) => -c);
        const gap = 13 / 30;
        arrow(k, v, 30, colours.place, 2.5, gap); arrow(k, back, 30, colours.place, 2.5, gap);
      }
      label("node " + data.ids[k], x + 18, y - 14, colours.place, true);
    }
  }

  function drawPlaces() {
    pen.lineWidth = 2.5; pen.strokeStyle = colours.alike;
    for (const k of data.ambiguous) disc(eye[3 * k], eye[3 * k + 1], 9, false);
    drawPlace(data.located, data.direction);
    for (const place of data.further) drawPlace(place.nodes, place.direction);
    if (data.ambiguous.length <= 8)
      for (const k of data.ambiguous) label(String(data.ids[k]), eye[3 * k] + 12, eye[3 * k + 1] - 9, colours.soft, false);
    if (hovered >= 0) { pen.strokeStyle = colours.ink; pen.lineWidth = 1.5; disc(eye[3 * hovered], eye[3 * hovered + 1], 5, false); }
  }

  function drawAxes() {
    const o = [44, height - 40], names = ["X", "Y", "Z"];
    [[1, 0, 0], [0, 1, 0], [0, 0, 1]].forEach((axis, k) => {
      const v = turned(...axis), b = basis;
      const dx = b[0] * v[0] + b[1] * v[1], dy = -(b[2] * v[0] + b[3] * v[1] + b[4] * v[2]);
      pen.strokeStyle = colours.soft; pen.lineWidth = 1.5;
      pen.beginPath(); pen.moveTo(o[0], o[1]); pen.lineTo(o[0] + 24 * dx, o[1] + 24 * dy); pen.stroke();
      if (Math.hypot(dx, dy) > 0.25) label(names[k], o[0] + 32 * dx - 4, o[1] + 32 * dy + 4, colours.soft, false);
    });
  }

  function nearest(x, y) {
    let best = -1, reach = 12 * 12;
    for (let i = 0; i < n; i++) {
      const d = (eye[3 * i] - x) ** 2 + (eye[3 * i + 1] - y) ** 2;
      if (d < reach) { reach = d; best = i; }
    }
    return best;
  }

  function describe(k) {
    const parts = ["node " + data.ids[k]];
    const at = [0, 1, 2].map((j) => Number(data.xyz[3 * k + j].toPrecision(5)));
    parts.push("(" + at.join(", ") + ") " + data.unit);
    for (const m of data.sensors) if (m.node === k) parts.push("sensor " + m.label);
    for (const m of data.shakers) if (m.node === k) parts.push("shaker " + m.label);
    if (data.located.includes(k) || data.further.some((place) => place.nodes.includes(k))) parts.push("located place");
    if (data.ambiguous.includes(k)) parts.push("not told apart from the located place");
    if (data.supports.includes(k)) parts.push("held");
    return parts.join("\n");
  }

  function hover(event) {
    const r = canvas.getBoundingClientRect(), x = event.clientX - r.left, y = event.clientY - r.top, k = nearest(x, y);
    if (k !== hovered) { hovered = k; redraw(); }
    tip.hidden = k < 0;
    if (k < 0) return;
    tip.textContent = describe(k);
    tip.style.left = Math.min(x + 14, width - 190) + "px"; tip.style.top = y + 14 + "px";
  }

  const held = new Map();
  canvas.addEventListener("pointerdown", (e) => { held.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); tip.hidden = true; });
  canvas.addEventListener("pointerup", (e) => held.delete(e.pointerId));
  canvas.addEventListener("pointercancel", (e) => held.delete(e.pointerId));
  canvas.addEventListener("pointerleave", () => { tip.hidden = true; if (hovered >= 0) { hovered = -1; redraw(); } });
  canvas.addEventListener("pointermove", (e) => {
    const last = held.get(e.pointerId);
    if (!last) { hover(e); return; }
    const dx = e.clientX - last[0], dy = e.clientY - last[1];
    if (held.size === 2) {
      const other = [...held.entries()].find(([id]) => id !== e.pointerId)[1];
      const before = Math.hypot(last[0] - other[0], last[1] - other[1]), now = Math.hypot(e.clientX - other[0], e.clientY - other[1]);
      view.zoom *= before > 0 ? now / before : 1;
    } else if (e.shiftKey || e.buttons === 4 || e.buttons === 2) { view.x += dx; view.y += dy; }
    else { view.azimuth += 0.5 * dx; view.elevation = Math.max(-90, Math.min(90, view.elevation + 0.5 * dy)); }
    held.set(e.pointerId, [e.clientX, e.clientY]);
    redraw();
  });
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    view.zoom = Math.max(0.2, Math.min(40, view.zoom * Math.exp(-0.0015 * e.deltaY)));
    redraw();
  }, { passive: false });
  canvas.addEventListener("dblclick", reset);
  canvas.addEventListener("keydown", (e) => {
    const steps = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] };
    if (steps[e.key]) { view.azimuth += steps[e.key][0]; view.elevation += steps[e.key][1]; }
    else if (e.key === "+" || e.key === "=") view.zoom *= 1.15;
    else if (e.key === "-") view.zoom /= 1.15;
    else if (e.key === "0") reset();
    else return;
    e.preventDefault(); redraw();
  });
  document.getElementById("mesh-reset").addEventListener("click", reset);

  function resize() {
    const ratio = window.devicePixelRatio || 1;
    width = box.clientWidth; height = box.clientHeight;
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { azimuth, elevation } = view;
    view.azimuth = data.view.azimuth; view.elevation = data.view.elevation;
    refit();
    view.azimuth = azimuth; view.elevation = elevation;
    draw();
  }
  window.femendRecolour = () => { readColours(); redraw(); };
  box.classList.add("live");
  readColours();
  view.azimuth = data.view.azimuth; view.elevation = data.view.elevation;
  resize();
  new ResizeObserver(resize).observe(box);
})();
