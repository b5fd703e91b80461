// page.js: draws the messages of omentum/view.h, and plays a recording of them.
'use strict';

const $ = (id) => document.getElementById(id);
const COLORS = { tissue: 0xe8c27a, organ: 0x9c3b3f, region: 0xd94fc2, tool: 0xb8c4cf, probe: 0xc8d6e2 };
const LANES = [
  { key: 'visibility', name: 'seen', unit: '%', scale: 100, digits: 0, color: '#56b4e9', least: 100 },
  { key: 'force', name: 'force', unit: 'N', scale: 1, digits: 2, color: '#e69f00', least: 0.1, also: 'forceTrue' },
  { key: 'mu', name: 'mu', unit: 'mm', scale: 1000, digits: 1, color: '#e58fc0', least: 2 },
  { key: 'height', name: 'height', unit: 'mm', scale: 1000, digits: 0, color: '#8fd3b6', least: 10 },
];
const WARNINGS = ['no warning', 'warning 1: the tissue is not where the twin has it', 'warning 2: slow, the twin is wrong',
  'warning 3: stop'];

// ---- messages -------------------------------------------------------------------------------------------------

const newLog = () => ({ scene: null, frames: [], points: [[], [], []], chances: [], ofPart: [], last: [] });

// A recording: the scene, its frames, and attachments, in the order of time.
function readMessages(buffer) {
  const view = new DataView(buffer), log = newLog();
  for (let at = 0; at + 8 <= buffer.byteLength;) {
    const size = view.getUint32(at, true), begin = at + 4;
    if (begin + size > buffer.byteLength) break;
    readMessage(log, buffer, view, begin);
    at = begin + size;
  }
  return log;
}

function readMessage(log, buffer, view, begin) {
  const kind = view.getUint32(begin, true);
  if (kind === 1) log.scene = readScene(buffer, view, begin);
  if (kind === 2 || kind === 4) readFrame(log, buffer, view, begin, kind === 4);
  if (kind === 3) readPoints(log, buffer, view, begin);
  if (kind === 5) log.chances.push({ index: log.frames.length, value: new Uint8Array(buffer.slice(begin + 8, begin + 8 + view.getUint32(begin + 4, true))) });
  return kind;
}

const padded = (begin, at) => at + (4 - (at - begin) % 4) % 4;

function readScene(buffer, view, begin) {
  const length = view.getUint32(begin + 4, true);
  const scene = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, begin + 8, length)));
  let at = padded(begin, begin + 8 + length);
  for (const part of scene.parts) {
    part.x = new Float32Array(buffer.slice(at, at + 12 * part.nvert));
    at += 12 * part.nvert;
    part.tri = new Uint32Array(buffer.slice(at, at + 12 * part.ntri));
    at += 12 * part.ntri;
  }
  return scene;
}

const FIELDS = ['stress', 'contact'];  // of a part in a frame, by bits

// Numbers of a frame, and of each part that moved its box, positions and fields as they are sent.
function readFrame(log, buffer, view, begin, isDifference) {
  const f = (k) => view.getFloat32(begin + 16 + 4 * k, true), index = log.frames.length;
  log.frames.push({ time: view.getFloat64(begin + 8, true), visibility: f(0), force: f(1), forceTrue: f(2), mu: f(3), height: f(4),
    warning: view.getUint32(begin + 36, true) });
  let at = begin + 44;
  for (let n = view.getUint32(begin + 40, true); n > 0; --n) {
    const part = view.getUint32(at, true), nvert = view.getUint32(at + 4, true);
    const e = { index, box: new Float32Array(buffer.slice(at + 8, at + 32)), x: new Uint16Array(buffer, at + 32, 3 * nvert), field: [], most: [] };
    at = padded(begin, at + 32 + 6 * nvert);
    const fields = view.getUint32(at, true);
    at += 4;
    for (let k = 0; k < FIELDS.length; ++k) {
      if (!(fields & 1 << k)) continue;
      e.most[k] = view.getFloat32(at, true);
      e.field[k] = new Uint8Array(buffer, at + 4, nvert);
      at = padded(begin, at + 4 + nvert);
    }
    if (isDifference) addLast(e, log.last[part]);
    log.last[part] = e;
    (log.ofPart[part] ??= []).push(e);
  }
}

// From differences to numbers, in place: they wrap around.
function addLast(e, last) {
  if (!last || e.box.some((value, k) => value !== last.box[k])) return;
  for (let i = 0; i < e.x.length; ++i) e.x[i] += last.x[i];
  e.field.forEach((now, k) => {
    const before = last.field[k];
    for (let i = 0; before && i < now.length; ++i) now[i] += before[i];
  });
}

function readPoints(log, buffer, view, begin) {
  const n = view.getUint32(begin + 8, true), at = begin + 12;
  log.points[view.getUint32(begin + 4, true)].push({ index: log.frames.length, x: new Float32Array(buffer.slice(at, at + 12 * n)) });
}

// The last entry at or before a frame.
function lastBefore(list, index) {
  let lo = 0, hi = list ? list.length : 0;
  while (lo < hi) {
    const mid = (lo + hi) >> 1;
    if (list[mid].index <= index) lo = mid + 1; else hi = mid;
  }
  return lo > 0 ? list[lo - 1] : null;
}

// ---- drawing --------------------------------------------------------------------------------------------------

// Dark blue to yellow, also for colour-blind eyes, as a palette of 256 steps.
const PALETTE = (() => {
  const stops = [[0.05, 0.13, 0.36], [0.2, 0.36, 0.6], [0.45, 0.6, 0.62], [0.8, 0.75, 0.45], [1, 0.9, 0.2]], out = [];
  for (let i = 0; i < 256; ++i) {
    const s = i / 255 * (stops.length - 1), k = Math.min(Math.floor(s), stops.length - 2);
    out.push(stops[k].map((c, j) => c + (s - k) * (stops[k + 1][j] - c)));
  }
  return out;
})();

class Stage {
  constructor(canvas, scene) {
    this.scene = scene;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.localClippingEnabled = true;
    this.world = new THREE.Scene();
    this.world.background = new THREE.Color(0x14181d);
    this.camera = new THREE.PerspectiveCamera(40, 1, 0.001, 10);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.draw());
    this.cut = new THREE.Plane(new THREE.Vector3(-1, 0, 0), 1e3);
    this.addLights();
    this.load(scene);
    this.dots = [this.addDots(0x56b4e9, 0.0035), this.addDots(0xf0e442, 0.0025), this.addDots(0xb8f0d0, 0.0016)];
    this.dots[1].visible = this.dots[2].visible = false;
    this.brush = this.addDots(0xff9f1c, 0.006);  // places that a brush has touched
    this.color = 'plain';
    this.look('near');
  }

  // What is drawn of a scene; another one takes its place.
  load(scene) {
    this.scene = scene;
    if (this.content) this.world.remove(this.content);
    for (const p of this.parts || []) p.mesh.geometry.dispose();
    this.content = new THREE.Group();
    this.world.add(this.content);
    this.parts = scene.parts.map((p) => this.addPart(p));
    if (scene.task.has_ground) this.addGround();
    this.frustum = this.addFrustum(this.scene.endoscope, 0x8fa3b5);
    this.frustum.visible = false;
  }

  addLights() {
    this.world.add(new THREE.HemisphereLight(0xffffff, 0x554444, 1.6));
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(-0.3, -0.4, 1);
    this.world.add(sun);
  }

  addPart(part) {
    const geometry = new THREE.BufferGeometry(), isTissue = part.kind === 'tissue';
    geometry.setAttribute('position', new THREE.BufferAttribute(part.x.slice(), 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setIndex(new THREE.BufferAttribute(part.tri, 1));
    if (isTissue) geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(3 * part.nvert).fill(1), 3));
    geometry.computeVertexNormals();
    const material = new THREE.MeshStandardMaterial({ color: COLORS[part.kind], roughness: part.kind === 'tool' ? 0.35 : 0.6,
      metalness: part.kind === 'tool' ? 0.6 : 0, side: THREE.DoubleSide, flatShading: part.kind === 'tool',
      clippingPlanes: part.kind === 'tool' ? [] : [this.cut], vertexColors: isTissue });
    if (part.kind === 'organ' && this.scene.region) this.colourRegion(part, geometry, material);
    const mesh = new THREE.Mesh(geometry, material);
    if (part.kind === 'region' && this.scene.region) mesh.material.visible = false;  // it is drawn on the organ
    mesh.frustumCulled = false;
    this.content.add(mesh);
    return { ...part, mesh, field: [], most: [] };
  }

  // The organ's surface within a circle has the region's colour. Drawn as triangles of its own, the region has a border
  // of spikes, as whole triangles of the organ are in it or not.
  colourRegion(part, geometry, material) {
    const { center, radius } = this.scene.region;
    this.region = { value: radius };
    geometry.setAttribute('rest', new THREE.BufferAttribute(part.x, 3));
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, { regionRadius: this.region, regionCenter: { value: new THREE.Vector3().fromArray(center) },
        regionColor: { value: new THREE.Color(COLORS.region) } });
      shader.vertexShader = shader.vertexShader.replace('#include <common>', '#include <common>\nattribute vec3 rest;\nvarying vec3 vRest;')
        .replace('#include <begin_vertex>', '#include <begin_vertex>\nvRest = rest;');
      shader.fragmentShader = shader.fragmentShader.replace('#include <common>', '#include <common>\nvarying vec3 vRest;\nuniform float regionRadius;\nuniform vec3 regionCenter, regionColor;')
        .replace('#include <color_fragment>', '#include <color_fragment>\nif (distance(vRest, regionCenter) < regionRadius) diffuseColor.rgb = regionColor;');
    };
  }

  showPart(part, on) {
    part.mesh.visible = on;
    if (part.kind === 'region' && this.scene.region) this.region.value = on ? this.scene.region.radius : 0;
  }

  addGround() {
    const half = this.scene.task.half_size, size = 4 * Math.max(half[0], half[1]);
    const grid = new THREE.GridHelper(size, Math.round(size / 0.02), 0x3d4854, 0x28303a);
    grid.rotation.x = Math.PI / 2;
    const group = new THREE.Group();
    group.add(grid);
    group.position.fromArray(this.scene.task.position);
    group.quaternion.fromArray(this.scene.task.quaternion);
    this.content.add(group);
  }

  // Lines from a camera's place to the corners of its picture.
  addFrustum(camera, color) {
    const { position, quaternion, fov_y_deg, aspect } = camera, far = 0.06, h = far * Math.tan(fov_y_deg * Math.PI / 360);
    const corner = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => [x * h * aspect, y * h, far]), line = [];
    for (let k = 0; k < 4; ++k) line.push(0, 0, 0, ...corner[k], ...corner[k], ...corner[(k + 1) % 4]);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(line), 3));
    const lines = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color }));
    lines.position.fromArray(position);
    lines.quaternion.fromArray(quaternion);
    this.content.add(lines);
    return lines;
  }

  // The grasping point over a place of the world, as commands name it, from 1.
  blockAt(p) {
    const { task, grid } = this.scene, half = task.half_size, d = new THREE.Vector3().subVectors(p, new THREE.Vector3().fromArray(task.position));
    const at = [this.turned(1, 0, 0), this.turned(0, 1, 0)].map((axis, k) => Math.floor((d.dot(axis) + half[k]) / (2 * half[k]) * grid));
    return at.every((i) => i >= 0 && i < grid) ? at.map((i) => i + 1) : null;
  }

  addDots(color, size) {
    const disc = Object.assign(document.createElement('canvas'), { width: 32, height: 32 }), g = disc.getContext('2d');
    g.fillStyle = '#fff';
    g.arc(16, 16, 14, 0, 7);
    g.fill();
    const dots = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ color, size, depthTest: false,
      transparent: true, opacity: 0.85, map: new THREE.CanvasTexture(disc) }));
    dots.frustumCulled = false;
    dots.renderOrder = 2;
    this.world.add(dots);
    return dots;
  }

  setDots(kind, x) { this.place(this.dots[kind], x); }

  place(dots, x) {
    dots.geometry.dispose();
    dots.geometry = new THREE.BufferGeometry();
    dots.geometry.setAttribute('position', new THREE.BufferAttribute(x, 3));
  }

  // A direction of the task frame as one of the world.
  turned(x, y, z) {
    const q = this.scene.task.quaternion, v = new THREE.Vector3(x, y, z);
    const u = new THREE.Vector3(q[0], q[1], q[2]), t = u.clone().cross(v).multiplyScalar(2);
    return v.addScaledVector(t, q[3]).add(u.clone().cross(t));
  }

  look(name) {
    const { task, endoscope } = this.scene, r = 2.1 * Math.max(task.half_size[0], task.half_size[1]) + 0.05;
    const middle = new THREE.Vector3().fromArray(task.position).add(this.turned(0, 0, task.half_size[2]));
    const from = { near: [-0.75, -0.75, 0.65], above: [0, -0.01, 1.35], side: [0, -1.3, 0.12], below: [-0.5, -0.6, -0.9] }[name];
    this.camera.fov = 40;
    this.controls.target.copy(middle);
    if (name === 'endoscope') {
      this.camera.fov = endoscope.fov_y_deg;
      this.camera.position.fromArray(endoscope.position);
    } else {
      this.camera.position.copy(middle).add(this.turned(...from).multiplyScalar(r * 1.25));
    }
    if (this.frustum && name === 'endoscope') this.frustum.visible = false;
    this.camera.up.copy(this.turned(0, 0, 1));
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }

  resize(width, height) {
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  // A part as a frame has it.
  movePart(part, e) {
    const p = this.parts[part], x = p.mesh.geometry.attributes.position;
    for (let i = 0; i < e.x.length; ++i) x.array[i] = e.box[i % 3] + e.box[3 + i % 3] * e.x[i] / 65535;
    x.needsUpdate = true;
    p.mesh.geometry.computeVertexNormals();
    p.field = e.field;
    p.most = e.most;
  }

  // The depth camera where it was when it took a picture: calibrated, in the real world, too.
  showDepthCamera(camera) {
    if (this.depthFrustum) this.content.remove(this.depthFrustum);
    this.depthFrustum = camera ? this.addFrustum(camera, 0x7fb99a) : null;
    if (this.depthFrustum) this.depthFrustum.visible = this.frustum.visible;
  }

  paint() {
    const p = this.parts[0], color = p.mesh.geometry.attributes.color, x = p.mesh.geometry.attributes.position.array;
    let most = 0, value = () => 0;
    if (this.color === 'displacement') {
      const d = new Float32Array(p.nvert);
      for (let i = 0; i < p.nvert; ++i) {
        d[i] = Math.hypot(x[3 * i] - p.x[3 * i], x[3 * i + 1] - p.x[3 * i + 1], x[3 * i + 2] - p.x[3 * i + 2]);
        most = Math.max(most, d[i]);
      }
      value = (i) => d[i] / (most || 1);
    } else if (this.color === 'attachment') {
      most = this.chances && this.chances.length === p.nvert ? 1 : 0;
      if (most) value = (i) => this.chances[i] / 255;
    } else {
      const k = FIELDS.indexOf(this.color), field = p.field[k];
      if (field) most = p.most[k];
      if (field) value = (i) => field[i] / 255;
    }
    p.mesh.material.color.set(this.color === 'plain' ? COLORS.tissue : 0xffffff);
    for (let i = 0; i < p.nvert; ++i) {
      const c = this.color === 'plain' ? [1, 1, 1] : PALETTE[Math.round(255 * value(i))];
      color.setXYZ(i, c[0], c[1], c[2]);
    }
    color.needsUpdate = true;
    return most;
  }

  setCut(share) {
    const half = this.scene.task.half_size[0], way = this.turned(-1, 0, 0);
    const place = new THREE.Vector3().fromArray(this.scene.task.position).addScaledVector(way, -(2 * share - 1) * half * 1.05);
    if (share >= 1) this.cut.constant = 1e3;
    else this.cut.setFromNormalAndCoplanarPoint(way, place);
    this.draw();
  }

  draw() { this.renderer.render(this.world, this.camera); }
}

// ---- numbers --------------------------------------------------------------------------------------------------

const text = (value, lane) => Number.isFinite(value) ? (value * lane.scale).toFixed(lane.digits).replace(/^-(0\.?0*)$/, '$1') + ' ' + lane.unit : '-';

class Chart {
  constructor(canvas, log) {
    this.canvas = canvas;
    this.log = log;
    this.most = LANES.map((lane) => lane.least);
    this.lanes = [0, 1, 2, 3];  // that are drawn
    this.nseen = 0;
  }

  // The largest of each lane, so far.
  grow() {
    for (; this.nseen < this.log.frames.length; ++this.nseen) {
      const f = this.log.frames[this.nseen];
      LANES.forEach((l, k) => {
        for (const key of [l.key, l.also]) if (key && f[key] * l.scale > this.most[k]) this.most[k] = f[key] * l.scale;
      });
    }
  }

  draw(time) {
    const ratio = devicePixelRatio, w = this.canvas.clientWidth, h = this.canvas.clientHeight, g = this.canvas.getContext('2d');
    this.canvas.width = w * ratio;
    this.canvas.height = h * ratio;
    g.scale(ratio, ratio);
    g.font = '11px system-ui, sans-serif';
    const frames = this.log.frames, end = frames[frames.length - 1].time || 1, lane = h / this.lanes.length;
    this.grow();
    this.lanes.forEach((which, k) => {
      const l = LANES[which], most = this.most[which];
      const y = (value) => (k + 1) * lane - 3 - (lane - 8) * value * l.scale / most;
      g.strokeStyle = '#35404c';
      g.strokeRect(0.5, k * lane + 0.5, w - 1, lane - 1);
      for (const [key, alpha] of [[l.also, 0.4], [l.key, 1]]) if (key) this.line(g, frames, (f) => f.time / end * w, (f) => y(f[key]), l.color, alpha);
      g.fillStyle = l.color;
      g.fillText(`${l.name}, to ${most.toFixed(l.digits)} ${l.unit}`, 5, k * lane + 12);
    });
    g.fillStyle = '#ffffffcc';
    g.fillRect(time / end * w - 0.75, 0, 1.5, h);
  }

  line(g, frames, x, y, color, alpha) {
    g.strokeStyle = color;
    g.globalAlpha = alpha;
    g.lineWidth = 1.5;
    g.beginPath();
    let isOn = false;
    for (const f of frames) {
      const v = y(f);
      if (Number.isFinite(v)) isOn ? g.lineTo(x(f), v) : g.moveTo(x(f), v);
      isOn = Number.isFinite(v);
    }
    g.stroke();
    g.globalAlpha = 1;
  }
}

// ---- the story ------------------------------------------------------------------------------------------------

// The lines of an audit that a person reads: time, words, and of a plan its reasons.
function readLine(line) {
  let e = null;
  try { e = JSON.parse(line); } catch { return null; }
  if (!e || !e.words || e.event === 'begin') return null;
  return { time: e.time_s || 0, event: e.event, words: e.words, why: Array.isArray(e.reasons) ? e.reasons : [] };
}

const readStory = (lines) => lines.split('\n').map(readLine).filter((e) => e);

function showStory(story, goTo) {
  for (const e of story) {
    const li = document.createElement('li'), time = document.createElement('time');
    li.className = e.event;
    li.tabIndex = 0;
    time.textContent = e.time.toFixed(1) + ' s';
    li.append(time, e.words);
    if (e.why.length) {
      const why = document.createElement('details'), head = document.createElement('summary');
      head.textContent = 'why';
      why.append(head);
      for (const reason of e.why) why.append(Object.assign(document.createElement('p'), { textContent: typeof reason === 'string' ? reason : JSON.stringify(reason) }));
      why.addEventListener('click', (event) => event.stopPropagation());
      li.append(why);
    }
    li.addEventListener('click', () => goTo(e.time));
    li.addEventListener('keydown', (event) => { if (event.key === 'Enter') goTo(e.time); });
    e.li = li;
    $('story').append(li);
  }
}

// Scroll a box, and not the page around it, as far as an element is out of its sight.
function showIn(box, element) {
  const outer = box.getBoundingClientRect(), inner = element.getBoundingClientRect();
  if (inner.bottom > outer.bottom) box.scrollTop += inner.bottom - outer.bottom;
  if (inner.top < outer.top) box.scrollTop += inner.top - outer.top;
}

// ---- the player -----------------------------------------------------------------------------------------------

// What a recording and a live page share: the scene, its numbers, buttons.
class Page {
  constructor(log, story, pictures) {
    this.log = log;
    this.story = story;
    this.pictures = pictures;
    this.stage = new Stage($('canvas'), this.log.scene);
    this.chart = new Chart($('chart'), this.log);
    this.drawn = [];  // what is drawn of each part
    this.picture = {};
    this.showsPictures = true;
    this.time = 0;
    showStory(story, (t) => this.goTo(t));
    this.addButtons();
    this.makeFacts();
    new ResizeObserver(() => this.resize()).observe($('stage'));
    this.resize();
  }

  goTo() {}

  resize() {
    this.stage.resize($('stage').clientWidth, $('stage').clientHeight);
    if (this.log.frames.length) this.chart.draw(this.time);
  }



  makeFacts() {
    for (const [key, name] of [['visibility', 'of the region seen'], ['force', 'force, by the twin'], ['forceTrue', 'force, in the truth'],
      ['mu', 'discrepancy of the twin'], ['height', 'lifted by'], ['rate', 'steps a second']]) {
      const div = document.createElement('div'), dt = document.createElement('dt'), dd = document.createElement('dd');
      dt.textContent = name;
      dt.id = 'name-' + key;
      div.id = 'of-' + key;
      dd.id = 'fact-' + key;
      div.append(dt, dd);
      $('facts').append(div);
    }
  }

  showNumbers(frame) {
    $('fact-visibility').textContent = text(frame.visibility, LANES[0]);
    $('fact-force').textContent = text(frame.force, LANES[1]);
    $('fact-forceTrue').textContent = text(frame.forceTrue, LANES[1]);
    $('fact-mu').textContent = text(frame.mu, LANES[2]);
    $('fact-height').textContent = text(frame.height, LANES[3]);
    $('fact-force').style.color = frame.force > this.log.scene.force_threshold_n ? '#ffb000' : '';
  }

  showStoryNow(warning) {
    let now = null;
    for (const e of this.story) {
      e.li.classList.toggle('later', e.time > this.time + 1e-6);
      e.li.classList.remove('now');
      if (e.time <= this.time + 1e-6) now = e;
    }
    if (now) now.li.classList.add('now');
    const hint = this.isLive || this.time > 0 || this.isPlaying ? '' : 'Press play or the space bar to watch the operation. ';
    const words = hint + (warning ? WARNINGS[warning] + '. ' : '') + (now ? now.words : 'At rest, before the operation.');
    if ($('status').textContent !== words) $('status').textContent = words;
    $('status').style.color = warning ? ['', '#ffd166', '#ffa94d', '#ff8787'][warning] : '';
    if (now && this.follows && now !== this.shown) showIn($('story'), now.li);
    this.shown = now;
  }


  showPicture() {
    for (const [isDepth, id, name] of [[false, 'endoscope', 'The endoscope'], [true, 'depth', 'The depth camera']]) {
      let now = null;
      for (const p of this.pictures) if (!!p.depth === isDepth && (this.isLive || p.time_s <= this.time + 1e-6)) now = p;
      $(id).hidden = !now || !this.showsPictures;
      if (this.picture[id] === now) continue;
      this.picture[id] = now;
      if (isDepth) this.stage.showDepthCamera(now);
      if (!now) continue;
      const img = $(id).querySelector('img');
      img.src = 'data:image/png;base64,' + now.png;
      img.alt = `${name}: ${now.caption}`;
      $(id).querySelector('figcaption').textContent = `${isDepth ? '' : 'Endoscope, '}${now.time_s.toFixed(1)} s: ${now.caption}`;
    }
  }

  showLegend(most) {
    const unit = { displacement: [1000, ' mm', 'displacement'], stress: [0.001, ' kPa', 'von Mises stress'], contact: [1, ' N', 'contact force'],
      attachment: [1, '', 'probability of attachment'] }[this.stage.color];
    $('legend').hidden = !unit;
    if (!unit) return;
    $('legend-name').textContent = unit[2];
    $('legend-ends').textContent = this.stage.color === 'attachment' && !most ? 'no estimate yet' : `0 to ${(most * unit[0]).toPrecision(3)}${unit[1]}`;
    const g = $('legend-bar').getContext('2d');
    for (let i = 0; i < 160; ++i) {
      g.fillStyle = `rgb(${PALETTE[Math.round(i / 159 * 255)].map((c) => Math.round(255 * Math.sqrt(c))).join(',')})`;
      g.fillRect(i, 0, 1, 10);
    }
  }


  button(group, name, isOn, press) {
    const b = document.createElement('button');
    b.textContent = name;
    b.setAttribute('aria-pressed', isOn);
    b.addEventListener('click', () => press(b));
    $(group).append(b);
    return b;
  }

  choose(group, b) {
    for (const other of $(group).querySelectorAll('button')) other.setAttribute('aria-pressed', other === b);
  }

  addButtons() {
    for (const name of ['near', 'above', 'side', 'below', 'endoscope'])
      this.button('views', name, name === 'near', (b) => { this.choose('views', b); this.stage.look(name); });
    this.colorButtons = {};
    for (const name of ['plain', 'displacement', 'stress', 'contact', 'attachment'])
      this.colorButtons[name] = this.button('colors', name, name === 'plain', (b) => {
        this.choose('colors', b);
        this.stage.color = name;
        this.showLegend(this.stage.paint());
        this.stage.draw();
      });
    this.toggles = {};
    const toggle = (name, get, set) => this.toggles[name] = this.button('shown', name, get(), (b) => {
      set(!get());
      b.setAttribute('aria-pressed', get());
      this.stage.draw();
    });
    const { stage } = this;
    for (const kind of ['tissue', 'organ', 'tool', 'region']) {
      const of = () => stage.parts.filter((p) => p.kind === kind);
      if (of().length) toggle({ tool: 'tools' }[kind] || kind, () => of().every((p) => p.mesh.visible), (on) => of().forEach((p) => stage.showPart(p, on)));
    }
    if (this.log.points[0].length || this.isLive) toggle('believed attachments', () => stage.dots[0].visible, (on) => { stage.dots[0].visible = on; });
    if (this.log.points[1].length || this.isLive) toggle('true attachments', () => stage.dots[1].visible, (on) => { stage.dots[1].visible = on; });
    if (this.log.points[2].length || this.isLive) toggle('measured cloud', () => stage.dots[2].visible, (on) => { stage.dots[2].visible = on; });
    toggle('cameras', () => stage.frustum.visible, (on) => {
      stage.frustum.visible = on;
      if (stage.depthFrustum) stage.depthFrustum.visible = on;
    });
    toggle('pictures', () => this.showsPictures, (on) => {
      this.showsPictures = on;
      this.showPicture();
    });
    $('cut').addEventListener('input', () => stage.setCut(Number($('cut').value)));
    $('ask').addEventListener('click', () => $('help').showModal());
    $('shot').addEventListener('click', () => this.saveShot());
    $('film').hidden = !window.MediaRecorder;
    $('film').addEventListener('click', () => this.toggleFilm());
  }

  save(name, url) { Object.assign(document.createElement('a'), { href: url, download: `${this.log.scene.title}-${name}` }).click(); }

  // What the canvas shows from now on, as a video of the browser's; a second press ends and saves it.
  toggleFilm() {
    if (this.film) {
      this.film.stop();
      return;
    }
    const type = ['video/webm;codecs=vp9', 'video/webm', 'video/mp4'].find((t) => MediaRecorder.isTypeSupported(t)), parts = [];
    if (!type) return;
    this.film = new MediaRecorder($('canvas').captureStream(30), { mimeType: type, videoBitsPerSecond: 8e6 });
    this.film.ondataavailable = (event) => parts.push(event.data);
    this.film.onstop = () => {
      const url = URL.createObjectURL(new Blob(parts, { type }));
      this.save(`${this.time.toFixed(1)}s.${type.includes('mp4') ? 'mp4' : 'webm'}`, url);
      setTimeout(() => URL.revokeObjectURL(url), 10000);
      this.film = null;
      this.showFilm();
    };
    this.film.start();
    this.stage.draw();  // the first picture, also of a scene at rest
    this.showFilm();
  }

  showFilm() {
    $('film').setAttribute('aria-pressed', !!this.film);
    $('film').setAttribute('aria-label', this.film ? 'End the video and save it' : 'Record a video');
  }

  saveShot() {
    this.stage.draw();
    this.save(`${this.time.toFixed(1)}s.png`, $('canvas').toDataURL('image/png'));
  }

  // Rows of the help, and what the keys do.
  addKeys(own) {
    const press = (group, k) => { const b = $(group).querySelectorAll('button')[k]; if (b) b.click(); };
    const keys = {
      ...own,
      ...Object.fromEntries([1, 2, 3, 4, 5].map((k) => [k, [k === 1 ? '1 to 5' : null, 'views', () => press('views', k - 1)]])),
      c: ['c', 'next colour', () => {
        const on = [...$('colors').querySelectorAll('button')].findIndex((b) => b.getAttribute('aria-pressed') === 'true');
        press('colors', (on + 1) % $('colors').querySelectorAll('button:not([hidden])').length);
      }],
      s: ['s', 'save a picture', () => this.saveShot()],
      r: ['r', 'record a video, or end it', () => this.toggleFilm()],
      '?': ['?', 'this help', () => $('help').showModal()],
    };
    for (const [name, what] of Object.values(keys)) {
      if (!name) continue;
      const row = $('keys').insertRow();
      row.insertCell().textContent = name;
      row.insertCell().textContent = what;
    }
    document.addEventListener('keydown', (event) => {
      const isPress = event.key === ' ' || event.key === 'Enter';  // of a button, which has the focus after a click
      const isTyping = event.target.closest('input[type="text"], textarea, select, dialog' + (isPress ? ', button, summary' : ''));
      if (!$('use-keys').checked || isTyping || event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
      event.preventDefault();
      keys[event.key][2]();
    });
  }
}

class Player extends Page {
  constructor(buffer, story, pictures) {
    super(readMessages(buffer), story, pictures);
    this.isPlaying = false;
    this.speed = 4;
    this.end = this.log.frames.length ? this.log.frames[this.log.frames.length - 1].time : 0;
    $('time').max = this.end;
    $('play').addEventListener('click', () => this.play(!this.isPlaying));
    $('speed').addEventListener('change', () => { this.speed = Number($('speed').value); });
    $('time').addEventListener('input', () => this.goTo(Number($('time').value)));
    const seek = (event) => this.goTo((event.clientX - $('chart').getBoundingClientRect().left) / $('chart').clientWidth * this.end);
    $('chart').addEventListener('pointerdown', seek);
    $('chart').addEventListener('pointermove', (event) => { if (event.buttons) seek(event); });
    const next = (way) => {
      const times = this.story.map((e) => e.time);
      const t = way > 0 ? times.find((s) => s > this.time + 1e-3) : times.reverse().find((s) => s < this.time - 1e-3);
      this.goTo(t ?? (way > 0 ? this.end : 0));
    };
    this.addKeys({
      ' ': ['space', 'play or pause', () => this.play(!this.isPlaying)],
      ArrowLeft: ['left', 'back by a second', () => this.goTo(this.time - 1)],
      ArrowRight: ['right', 'on by a second', () => this.goTo(this.time + 1)],
      ',': [',', 'decision before', () => next(-1)],
      '.': ['.', 'next decision', () => next(1)],
    });
    this.goTo(0);
  }

  get follows() { return this.isPlaying; }

  frameAt(time) {
    const frames = this.log.frames;
    let lo = 0, hi = frames.length;
    while (lo < hi) {
      const mid = (lo + hi) >> 1;
      if (frames[mid].time <= time + 1e-9) lo = mid + 1; else hi = mid;
    }
    return Math.max(0, lo - 1);
  }

  goTo(time) {
    this.time = Math.min(Math.max(time, 0), this.end);
    if (!this.log.frames.length) return;
    const index = this.frameAt(this.time), frame = this.log.frames[index];
    this.log.scene.parts.forEach((_, k) => {
      const e = lastBefore(this.log.ofPart[k], index);
      if (e && this.drawn[k] !== e) this.stage.movePart(k, e);
      this.drawn[k] = e;
    });
    for (const kind of [0, 1, 2]) {
      const e = lastBefore(this.log.points[kind], index);
      if (this.stage.dots[kind].userData.of !== e) this.stage.setDots(kind, e ? e.x : new Float32Array(0));
      this.stage.dots[kind].userData.of = e;
    }
    this.stage.chances = lastBefore(this.log.chances, index)?.value;
    this.showLegend(this.stage.paint());
    this.stage.draw();
    this.showNumbers(frame);
    this.showStoryNow(frame.warning);
    this.showPicture();
    $('time').value = this.time;
    $('clock').textContent = `${this.time.toFixed(1)} of ${this.end.toFixed(1)} s`;
    this.chart.draw(this.time);
  }


  play(isPlaying) {
    this.isPlaying = isPlaying;
    $('play').innerHTML = isPlaying ? '&#10074;&#10074;' : '&#9654;';
    $('play').setAttribute('aria-label', isPlaying ? 'Pause' : 'Play');
    if (!isPlaying) return;
    if (this.time >= this.end) this.goTo(0);
    let last = performance.now();
    const step = (now) => {
      if (!this.isPlaying) return;
      this.goTo(this.time + (now - last) / 1000 * this.speed);
      last = now;
      if (this.time >= this.end) this.play(false);
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}

// ---- a live page ----------------------------------------------------------------------------------------------

const RUN = [['pause', 'pause'], ['go', 'go'], ['plan', 'new plan'], ['yes', 'approve'], ['no', 'reject'], ['abort', 'stop the operation']];
const FREE = [['pause', 'pause'], ['go', 'go'], ['step', 'one step'], ['reset', 'reset']];
const MOST_FRAMES = 20000;  // numbers of the chart

class Live extends Page {
  constructor(log, socket) {
    super(log, [], []);
    this.socket = socket;
    this.mode = '';
    this.hasControl = false;
    document.body.classList.add('live');
    for (const id of ['play', 'speed', 'time']) $(id).hidden = true;
    this.addKeys({ ' ': ['space', 'pause or go', () => this.send(this.isPaused || this.isHeld ? 'go' : 'pause')],
      g: ['g', 'a hand: grasp and pull', () => this.setTool('grasp')], b: ['b', 'a hand: press with a ball', () => this.setTool('press')] });
    this.addHand();
    this.addMaterial();
    this.brush = '';
    const brush = (word, name) => this.button('brush', name, !word, (b) => {
      this.choose('brush', b);
      this.brush = word;
    });
    for (const [word, name] of [['', 'off'], ['attach', 'held here'], ['free', 'free here'], ['forbid', 'do not grasp']]) brush(word, name);
  }

  get isLive() { return true; }
  get follows() { return true; }

  // A person answers the plan that the page shows, by its name.
  send(line) {
    const names = /^(y|ye|yes|n|no)$/.test(line) && this.mode === 'run' && this.plan;
    this.sendRaw(names ? `${line} ${this.plan}` : line);
  }

  sendRaw(line) { if (this.socket.readyState === WebSocket.OPEN) this.socket.send(line); }

  // Messages are read at once, the newest is drawn when the screen is ready: a slow screen shows fewer frames, not old ones.
  wantFrame() {
    if (this.isWanted) return;
    this.isWanted = true;
    requestAnimationFrame(() => {
      this.isWanted = false;
      this.showFrame();
    });
  }

  showFrame() {
    const frames = this.log.frames, frame = frames[frames.length - 1];
    if (!frame) return;  // another scene follows
    this.time = frame.time;
    this.log.scene.parts.forEach((_, k) => {
      const e = this.log.ofPart[k]?.at(-1);
      if (!e) return;
      if (this.drawn[k] !== e) this.stage.movePart(k, e);
      this.drawn[k] = e;
    });
    this.showLegend(this.stage.paint());
    this.stage.draw();
    this.showNumbers(frame);
    if (this.mode === 'run') this.showStoryNow(frame.warning);
    this.showForce(frame);
    this.showPicture();
    $('clock').textContent = `${this.time.toFixed(1)} s`;
    this.chart.draw(this.time);
  }

  showPoints() {
    this.stage.chances = this.log.chances.at(-1)?.value;
    for (const kind of [0, 1, 2]) {
      const list = this.log.points[kind];
      if (list.length) this.stage.setDots(kind, list[list.length - 1].x);
    }
    this.stage.draw();
  }

  take(message) {
    if (message.words) {
      const e = readLine(JSON.stringify(message));
      if (!e) return;
      this.story.push(e);
      showStory([e], () => {});
    }
    if (message.png) this.pictures = [...this.pictures.filter((p) => !!p.depth !== !!message.depth), message];
    if (message.say) this.say(message.say, message.is_error);
    if (message.mode) this.setMode(message);
    if (message.rate) this.showRate(message.rate);
    if ('control' in message) {
      this.hasControl = message.control;
      this.showControl();
    }
  }

  // Each mark of a brush is answered: the answers stand below each other.
  say(words, isError) {
    const isMore = this.nanswer > 0;
    if (isMore) --this.nanswer;
    $('said').textContent = isMore && this.answers ? `${this.answers}\n${words}` : words;
    $('said').classList.toggle('error', !!isError);
    this.answers = isMore ? $('said').textContent : '';
  }

  // ---- a brush: the grasping points under the pointer, one command each

  beginBrush(hit) {
    this.painted = new Map();
    this.paint(hit);
  }

  paint(hit) {
    const at = hit && this.restOf(hit), block = at && this.stage.blockAt(at);
    if (block) this.painted.set(block.join(' '), hit.point.clone());
    this.stage.place(this.stage.brush, new Float32Array([...this.painted.values()].flatMap((p) => [p.x, p.y, p.z])));
    this.stage.draw();
  }

  endBrush() {
    const blocks = [...this.painted.keys()];
    this.painted = null;
    this.nanswer = blocks.length;
    this.answers = '';
    blocks.forEach((block, k) => setTimeout(() => this.send(`${this.brush} ${block}`), 40 * k));
    setTimeout(() => {
      this.stage.place(this.stage.brush, new Float32Array(0));
      this.stage.draw();
    }, 1500);
  }

  // Where the tissue under the pointer was at rest: lifted tissue keeps its grasping points.
  restOf(hit) {
    const rest = this.stage.parts[0].x, { a, b, c } = hit.face, p = new THREE.Vector3();
    for (const v of [a, b, c]) p.add(new THREE.Vector3(rest[3 * v], rest[3 * v + 1], rest[3 * v + 2]).divideScalar(3));
    return p;
  }

  setMode(message) {
    if (this.mode !== message.mode) {
      this.mode = message.mode;
      $('commands').hidden = false;
      $('commands').replaceChildren($('commands').querySelector('legend'));
      this.buttons = {};
      for (const [line, name] of this.mode === 'free' ? FREE : RUN) this.buttons[line] = this.button('commands', name, false, () => this.send(line));
      $('hand').hidden = this.mode !== 'free';
      $('line').hidden = this.mode !== 'run';
      document.body.classList.toggle('free', this.mode === 'free');
      this.chart.lanes = this.mode === 'free' ? [1] : [0, 1, 2, 3];
      $('brush').hidden = this.mode !== 'run';
      if (this.mode === 'free') {
        this.setTool('grasp');
        for (const name of ['true attachments', 'measured cloud', 'pictures']) this.toggles[name].hidden = true;  // there is no robot, and no truth
        this.colorButtons.attachment.hidden = true;
      }
      this.showControl();
    }
    if (this.mode === 'free') this.showMaterial(message);
    this.isPaused = message.paused;
    this.plan = message.plan;
    this.isHeld = message.holds;
    if (this.mode === 'run') {
      for (const line of ['yes', 'no']) this.buttons[line].hidden = !message.asks;
      this.buttons.pause.hidden = message.paused || message.holds;
      this.buttons.go.hidden = !(message.paused || message.holds);
      for (const b of Object.values(this.buttons)) b.disabled = message.ended || !this.hasControl;
      $('wants').textContent = message.asks ? 'May this plan begin?' : message.holds ? 'The robot waits for you: ' + message.reason
        : message.ended ? 'The operation has ended.' : '';
    }
  }

  showControl() {
    for (const b of document.querySelectorAll('#commands button, #brush button, #hand button, #hand input, #hand select')) b.disabled = !this.hasControl;
    $('watching').hidden = this.hasControl;
  }

  // ---- a click on the tissue of a run: what a person may say about the grasping point there

  showChoices(event, p) {
    const block = this.stage.blockAt(p);
    $('choices').hidden = !block;
    if (!block) return;
    const box = $('stage').getBoundingClientRect();
    $('choices').style.left = Math.min(event.clientX - box.left, box.width - 170) + 'px';
    $('choices').style.top = Math.min(event.clientY - box.top, box.height - 190) + 'px';
    $('choices').replaceChildren();
    const words = [['forbid', 'do not grasp here'], ['allow', 'may be grasped'], ['attach', 'the tissue is held here'], ['free', 'it is free here']];
    for (const [word, name] of words) {
      const b = document.createElement('button');
      b.textContent = name;
      b.addEventListener('click', () => {
        this.send(`${word} ${block[0]} ${block[1]}`);
        $('choices').hidden = true;
      });
      $('choices').append(b);
    }
    $('choices').prepend(Object.assign(document.createElement('b'), { textContent: `Point (${block[0]},${block[1]})` }));
  }

  // ---- a hand: grasp where the pointer meets the tissue, pull in the plane that faces the camera

  addHand() {
    const canvas = $('canvas'), ray = new THREE.Raycaster(), at = new THREE.Vector2(), p = new THREE.Vector3();
    let drag = null;
    const tissueHit = () => {
      const tissue = this.stage.parts[0].mesh;
      tissue.geometry.computeBoundingSphere();
      return ray.intersectObject(tissue)[0];
    };
    const aim = (event) => {
      const box = canvas.getBoundingClientRect();
      at.set((event.clientX - box.left) / box.width * 2 - 1, 1 - (event.clientY - box.top) / box.height * 2);
      ray.setFromCamera(at, this.stage.camera);
    };
    let down = null;
    canvas.addEventListener('pointerdown', (event) => {
      down = [event.clientX, event.clientY];
      $('choices').hidden = true;
    });
    canvas.addEventListener('pointerup', (event) => {
      const isClick = down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 5;
      if (this.mode !== 'run' || !this.hasControl || !isClick) return;
      aim(event);
      const hit = tissueHit();
      if (hit && !this.brush) this.showChoices(event, this.restOf(hit));
    });
    const line = (word) => `${word} ${p.x.toFixed(5)} ${p.y.toFixed(5)} ${p.z.toFixed(5)}`;
    canvas.addEventListener('pointerdown', (event) => {
      if (this.mode !== 'run' || !this.hasControl || !this.brush || event.button !== 0 || !event.isPrimary) return;
      aim(event);
      const hit = tissueHit();
      if (!hit) return;
      this.stage.controls.enabled = false;
      canvas.setPointerCapture(event.pointerId);
      this.beginBrush(hit);
      event.stopImmediatePropagation();
    }, true);
    canvas.addEventListener('pointermove', (event) => {
      if (!this.painted) return;
      aim(event);
      this.paint(tissueHit());
    });
    canvas.addEventListener('pointerdown', (event) => {
      if (this.mode !== 'free' || !this.hasControl || event.button !== 0 || !event.isPrimary) return;
      aim(event);
      const hit = tissueHit();
      if (!hit) return;
      drag = this.beginDrag(hit, ray.ray, event);
      p.copy(drag.from);
      this.isPulling = true;
      this.pointer = [event.clientX, event.clientY];
      this.stage.controls.enabled = false;
      canvas.setPointerCapture(event.pointerId);
      this.send(line(this.tool));
      event.stopImmediatePropagation();
    }, true);
    canvas.addEventListener('pointermove', (event) => {
      if (!this.isPulling) return;
      aim(event);
      this.pointer = [event.clientX, event.clientY];
      if (drag.to(ray.ray, event, p)) this.next = line('move');
    });
    const end = () => {
      if (this.painted) this.endBrush();
      if (!this.isPulling) {
        this.stage.controls.enabled = true;
        return;
      }
      this.isPulling = false;
      this.stage.controls.enabled = true;
      this.next = null;
      this.send('release');
    };
    canvas.addEventListener('pointerup', end);
    canvas.addEventListener('pointercancel', end);
    setInterval(() => { if (this.next) this.send(this.next); this.next = null; }, 25);
    $('line').addEventListener('keydown', (event) => {
      if (event.key !== 'Enter' || !$('line').value.trim()) return;
      this.send($('line').value.trim());
      $('line').value = '';
    });
  }

  // A drag that began where a ray met the tissue: from there to a point of each later ray.
  // Grasped tissue follows in the plane that faces the camera. A probe begins outside of the surface and follows in the
  // plane of its normal, so that a drag towards the tissue presses; where one looks along the normal, a longer drag is a
  // deeper press.
  beginDrag(hit, ray, event) {
    const { camera } = this.stage, view = camera.getWorldDirection(new THREE.Vector3()), at = hit.point.clone(), plane = new THREE.Plane(), q = new THREE.Vector3();
    if (this.tool === 'grasp') {
      plane.setFromNormalAndCoplanarPoint(view.negate(), at);
      return { from: at, to: (r, _, p) => r.intersectPlane(plane, p) };
    }
    const normal = hit.face.normal.clone();
    if (normal.dot(ray.direction) > 0) normal.negate();
    const from = at.clone().addScaledVector(normal, this.radius), across = view.clone().addScaledVector(normal, -view.dot(normal));
    if (across.length() < 0.35) {
      const begin = [event.clientX, event.clientY], pixel = 2 * hit.distance * Math.tan(camera.fov * Math.PI / 360) / $('canvas').clientHeight;
      return { from, to: (_, e, p) => p.copy(from).addScaledVector(normal, -pixel * Math.hypot(e.clientX - begin[0], e.clientY - begin[1])) };
    }
    plane.setFromNormalAndCoplanarPoint(across.normalize(), at);
    return { from, to: (r, _, p) => r.intersectPlane(plane, q) && p.copy(from).add(q).sub(at) };
  }

  setTool(tool) {
    if (this.mode !== 'free' || this.toolButtons[tool].hidden) return;
    this.tool = tool;
    for (const [k, b] of Object.entries(this.toolButtons)) b.setAttribute('aria-pressed', k === tool);
    $('radius-label').hidden = tool !== 'press';
    $('name-force').textContent = tool === 'press' ? 'force of the probe' : 'force of your hand, with the weight';
    $('status').textContent = tool === 'press' ? 'Drag into the tissue: a ball presses it. Drag beside it to turn the view.'
      : 'Drag the tissue: it is grasped and pulled. Drag beside it to turn the view.';
  }

  // ---- what the tissue is made of

  addMaterial() {
    this.toolButtons = { grasp: this.button('tools', 'grasp and pull', true, () => this.setTool('grasp')),
      press: this.button('tools', 'press with a ball', false, () => this.setTool('press')) };
    const name = () => {
      $('young-name').textContent = `Modulus, times ${(2 ** Number($('young').value)).toPrecision(2)}`;
      $('poisson-name').textContent = `Poisson's ratio ${Number($('poisson').value).toFixed(2)}`;
      $('radius-name').textContent = `Radius of the ball, ${(10 ** Number($('radius').value)).toPrecision(2)} mm`;
    };
    this.nameMaterial = name;
    for (const id of ['young', 'poisson', 'radius']) $(id).addEventListener('input', name);
    $('young').addEventListener('change', () => this.send('young ' + (2 ** Number($('young').value)).toFixed(4)));
    $('poisson').addEventListener('change', () => this.send('poisson ' + $('poisson').value));
    $('radius').addEventListener('change', () => this.send('probe ' + (10 ** Number($('radius').value) / 1000).toFixed(5)));
    for (const id of ['law', 'element', 'engine']) $(id).addEventListener('change', () => this.send(`${id} ${$(id).value}`));
  }

  // As the program has it now, also where it refused a choice.
  showMaterial(message) {
    this.radius = message.radius;
    for (const [id, names] of [['law', message.laws], ['element', message.elements], ['engine', message.engines]]) {
      $(id).replaceChildren(...names.map((n) => new Option(n, n)));
      $(id).value = message[id];
      $(id).closest('label').hidden = names.length < 2;
    }
    $('young').value = Math.log2(message.young);
    $('poisson').value = message.poisson;
    $('radius').value = Math.log10(1000 * message.radius);
    this.nameMaterial();
    this.toolButtons.press.hidden = !message.can_press;
    if (!message.can_press && this.tool === 'press') this.setTool('grasp');
  }

  // Steps on the wall, and how many there could be.
  showRate(rate) {
    const most = rate.step_ms > 0 ? 1000 / rate.step_ms : 0;
    $('fact-rate').textContent = this.isPaused || !most ? '-' : `${rate.steps_per_s.toFixed(0)}, of ${rate.step_ms.toFixed(1)} ms`;
    $('name-rate').textContent = `steps a second, ${rate.nvert} nodes`;
    document.body.classList.toggle('slow', !this.isPaused && rate.step_ms > rate.time_step_ms);
  }

  // Another scene takes the place of this one.
  clear() {
    Object.assign(this.log, newLog(), { scene: this.log.scene });
    this.story = [];
    this.pictures = [];
    this.shown = null;
    $('story').replaceChildren();
    this.chart.nseen = 0;
    this.chart.most = LANES.map((lane) => lane.least);
  }

  newScene() {
    const before = this.stage.scene.task, now = this.log.scene.task;
    this.drawn = [];
    this.stage.load(this.log.scene);
    if (JSON.stringify(before) !== JSON.stringify(now)) this.stage.look('near');
    for (const b of $('shown').querySelectorAll('button')) if (b.getAttribute('aria-pressed') === 'false' && !b.textContent.includes('attachments')) b.click();
  }

  showForce(frame) {
    $('pull').hidden = !(this.isPulling && Number.isFinite(frame.force));
    if ($('pull').hidden || !this.pointer) return;
    const box = $('stage').getBoundingClientRect();
    $('pull').style.left = this.pointer[0] - box.left + 14 + 'px';
    $('pull').style.top = this.pointer[1] - box.top - 10 + 'px';
    $('pull').textContent = frame.force.toFixed(2) + ' N';
  }
}

// Of a live log only the last entry of each part is needed, with the last stress, and some hours of numbers. A tab that
// nobody sees draws nothing, and must not grow either.
function trim(log) {
  for (const list of log.ofPart) {
    if (!list || list.length < 2) continue;
    const before = list[list.length - 2], e = list[list.length - 1];
    if (!e.field.length) Object.assign(e, { field: before.field, most: before.most });
    list.splice(0, list.length - 1);
  }
  for (const list of [...log.points, log.chances]) list.splice(0, list.length - 1);
  if (log.frames.length > MOST_FRAMES) {
    log.frames.splice(0, MOST_FRAMES / 2);
    if (window.live) window.live.chart.nseen = 0;
  }
}

// A page of a server: the scene arrives first; after a lost connection the page begins again.
function connect() {
  const socket = new WebSocket(`ws://${location.host}/${location.search}`, 'omentum');
  const early = [], log = newLog();
  socket.binaryType = 'arraybuffer';
  socket.onmessage = (event) => {
    if (typeof event.data === 'string') {
      const message = JSON.parse(event.data);
      if (message.clear && window.live) window.live.clear();
      else if (window.live) window.live.take(message);
      else early.push(message);
      return;
    }
    const kind = readMessage(log, event.data, new DataView(event.data), 0);
    trim(log);
    if (kind === 1 && !window.live) {
      try {
        window.live = new Live(log, socket);
      } catch (error) {
        $('status').textContent = 'This browser cannot draw the scene: ' + error.message;
        socket.onclose = null;
        socket.close();
        return;
      }
      for (const message of early) window.live.take(message);
    }
    else if (kind === 1) window.live.newScene();
    if (kind === 2 && window.live) window.live.wantFrame();
    if ((kind === 3 || kind === 5) && window.live) window.live.showPoints();
  };
  // A page that nobody sees is silent: another one may take the controls, and without one the run is paused.
  const beat = () => { if (!document.hidden && socket.readyState === WebSocket.OPEN) socket.send('beat'); };
  socket.onopen = beat;
  setInterval(beat, 500);
  document.addEventListener('visibilitychange', beat);
  socket.onclose = () => {
    $('status').textContent = 'The program is not there any more. This page looks for it once a second.';
    setTimeout(retry, 1000);
  };
}

async function retry() {
  try {
    await fetch(location.href, { cache: 'no-store' });
    location.reload();
  } catch {
    setTimeout(retry, 1000);
  }
}

// ---- begin ----------------------------------------------------------------------------------------------------

async function inflate(base64) {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Response(stream).arrayBuffer();
}

async function begin() {
  const back = $('back').getAttribute('href');
  if (!back) $('back').hidden = true;
  // a server of this page alone has no report
  if (back && location.protocol !== 'file:') fetch(back, { method: 'HEAD' }).then((r) => { $('back').hidden = !r.ok; }, () => { $('back').hidden = true; });
  if (!$('messages').textContent.trim()) {
    $('status').textContent = 'Waiting for the scene.';
    connect();
    return;
  }
  const buffer = await inflate($('messages').textContent.trim());
  window.player = new Player(buffer, readStory($('story-lines').textContent), JSON.parse($('pictures').textContent));
  $('messages').remove();
}

begin().catch((error) => { $('status').textContent = 'This page cannot be shown: ' + error.message; });
