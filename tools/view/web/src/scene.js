// The cell in three dimensions: solids, a tool in its holder, a path, and the pair that is nearest. Z is up.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const colour = (name) => new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue(name).trim());
// A material remembers the name of its colour: the scheme of the page may change.
function material(kind, name, more = {}) {
  const made = new kind({ color: colour(name), ...more });
  made.userData.colour = name;
  return made;
}
const COLOURS = { machine: "--series4", fixture: "--series1", workpiece: "--series3" };

function geometryOf(solid) {
  if (solid.shape === "box") return new THREE.BoxGeometry(...solid.size_mm);
  if (solid.shape === "sphere") return new THREE.SphereGeometry(solid.radius_mm, 32, 20);
  if (solid.shape === "cylinder") return new THREE.CylinderGeometry(solid.radius_mm, solid.radius_mm, solid.height_mm, 40).rotateX(Math.PI / 2);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(solid.corners_mm ?? [], 3));
  geometry.computeVertexNormals();
  return geometry;
}

// Axes nested in each other from the base outwards; a group turns about a line of the one that carries it.
class Axes {
  constructor(described, carries, base) {
    this.outermost = base;
    this.groups = described.filter((axis) => axis.carries === carries).map((axis) => {
      const group = new THREE.Group();
      group.matrixAutoUpdate = false;
      this.outermost.add(group);
      this.outermost = group;
      return { axis, group, through: new THREE.Vector3(...axis.through_mm) };
    });
  }
  groupOf(letter) { return this.groups.find((one) => one.axis.letter === letter)?.group; }
  // above: height of the gauge line, from which a head is described.
  turn(angles, above = 0) {
    for (const { axis, group, through } of this.groups) {
      const at = through.clone().add(new THREE.Vector3(0, 0, above));
      group.matrix.makeTranslation(at).multiply(new THREE.Matrix4().makeRotationAxis(new THREE.Vector3(...axis.direction), THREE.MathUtils.degToRad(angles["ABC".indexOf(axis.letter)] ?? 0)))
        .multiply(new THREE.Matrix4().makeTranslation(at.negate()));
      group.matrixWorldNeedsUpdate = true;
    }
  }
}

// What a program leaves of an upright box: flat cells with steps between them, about the middle of the box.
function remaining(solid, { cell_mm, columns, rows, heights_mm }) {
  const [width, depth, height] = solid.size_mm;
  const x = (c) => Math.min(width, c * cell_mm) - width / 2, y = (r) => Math.min(depth, r * cell_mm) - depth / 2, z = (mm) => mm - height / 2;
  const at = (r, c) => (r < 0 || c < 0 || r >= rows || c >= columns ? 0 : heights_mm[r * columns + c]);
  const corners = [];
  const quad = (a, b, c, d) => corners.push(...a, ...b, ...c, ...a, ...c, ...d);
  for (let r = 0; r <= rows; ++r) {
    for (let c = 0; c <= columns; ++c) {
      const here = at(r, c), left = at(r, c - 1), below = at(r - 1, c);
      if (here > 0) quad([x(c), y(r), z(here)], [x(c + 1), y(r), z(here)], [x(c + 1), y(r + 1), z(here)], [x(c), y(r + 1), z(here)]);
      if (here !== left) quad([x(c), y(r), z(left)], [x(c), y(r), z(here)], [x(c), y(r + 1), z(here)], [x(c), y(r + 1), z(left)]);
      if (here !== below) quad([x(c), y(r), z(below)], [x(c), y(r), z(here)], [x(c + 1), y(r), z(here)], [x(c + 1), y(r), z(below)]);
    }
  }
  quad([-width / 2, -depth / 2, -height / 2], [width / 2, -depth / 2, -height / 2], [width / 2, depth / 2, -height / 2], [-width / 2, depth / 2, -height / 2]);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
  geometry.computeVertexNormals();
  return geometry;
}

const upright = (radius, from, to) => new THREE.CylinderGeometry(radius, radius, to - from, 40).rotateX(Math.PI / 2).translate(0, 0, (from + to) / 2);

export class Picture {
  constructor(holder, cell) {
    this.holder = holder;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    holder.append(this.renderer.domElement);
    this.renderer.domElement.setAttribute("role", "img");
    this.renderer.domElement.setAttribute("aria-label", `The cell ${cell.name}: ${cell.solids.map((solid) => solid.name).join(", ")}`);
    this.scene = new THREE.Scene();
    this.scene.background = colour("--plot");
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8a8a, 2.2));
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(1, -2, 3);
    this.scene.add(sun);
    this.camera = new THREE.PerspectiveCamera(35, 1, 1, 50000);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
    this.controls.addEventListener("start", () => { this.looking = true; });
    this.solids = new Map();
    this.table = new Axes(cell.rotary, "solids", this.scene);
    for (const solid of cell.solids) {
      const cut = solid.part === "workpiece";
      const mesh = new THREE.Mesh(geometryOf(solid), material(THREE.MeshStandardMaterial, COLOURS[solid.part], { roughness: 0.75, transparent: cut, opacity: cut ? 0.8 : 1, side: THREE.DoubleSide }));
      mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(mesh.geometry, 30), material(THREE.LineBasicMaterial, "--ink", { transparent: true, opacity: 0.45 })));
      mesh.position.set(...solid.at_mm);
      mesh.rotation.set(...solid.turn_deg.map(THREE.MathUtils.degToRad), "ZYX");
      this.solids.set(solid.name, mesh);
      (this.table.groupOf(solid.moves_with) ?? this.scene).add(mesh);
    }
    this.tool = new THREE.Group();
    this.head = new Axes(cell.rotary, "tool", this.tool);
    this.parts = new THREE.Group();
    this.head.outermost.add(this.parts);
    this.turn([0, 0, 0]);
    this.pair = new THREE.Group();
    this.path = new THREE.Group();
    this.scene.add(this.tool, this.pair, this.path);
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(holder);
    this.redraw = () => this.recolour();
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.scheme.addEventListener("change", this.redraw);
    this.fit();
  }
  fit() {
    const { clientWidth: width, clientHeight: height } = this.holder;
    if (width === 0) return;
    this.renderer.setPixelRatio(devicePixelRatio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.looking) this.draw();
    else this.home();
  }
  // The whole cell, until somebody turns it.
  home() {
    this.looking = false;
    const all = new THREE.Box3();
    for (const mesh of this.solids.values()) all.expandByObject(mesh);
    all.expandByObject(this.tool);
    if (all.isEmpty()) all.set(new THREE.Vector3(-100, -100, -100), new THREE.Vector3(100, 100, 100));
    const middle = all.getCenter(new THREE.Vector3()), size = Math.max(50, all.getSize(new THREE.Vector3()).length());
    this.controls.target.copy(middle);
    const away = (size * 1.45) / Math.min(1, this.camera.aspect); // on a phone the width decides
    this.camera.position.copy(middle).add(new THREE.Vector3(0.55, -1, 0.6).normalize().multiplyScalar(away));
    this.controls.update();
    this.draw();
  }
  // A geometry stays in the graphics memory until it is disposed of.
  empty(group) {
    for (const one of group.children) { one.geometry.dispose(); one.material.dispose(); }
    group.clear();
  }
  setTool(tool) {
    this.empty(this.parts);
    const part = (geometry, name) => this.parts.add(new THREE.Mesh(geometry, material(THREE.MeshStandardMaterial, name, { roughness: 0.5, metalness: 0.2 })));
    const long = tool.assembled_length_mm;
    part(upright(tool.radius_mm, 0, tool.cutting_mm), "--series2");
    part(upright(tool.radius_mm, tool.cutting_mm, long), "--series4");
    part(upright(tool.holder_radius_mm, long, long + tool.holder_length_mm), "--neutral");
    this.parts.position.set(...tool.tip_from_axis_mm, 0);
    this.gauge = long + tool.holder_length_mm;
    this.turn(this.angles);
    this.draw();
  }
  turn(angles) {
    this.angles = angles;
    this.table.turn(angles);
    this.head.turn(angles, this.gauge ?? 0);
  }
  // angles: of A, B and C, degrees.
  moveTool([x, y, z], angles) {
    this.tool.position.set(x, y, z);
    this.turn(angles);
    this.draw();
  }
  showPair(nearest, hit) {
    this.empty(this.pair);
    for (const mesh of this.solids.values()) mesh.material.emissive?.set(0);
    const solid = this.solids.get(nearest.solid);
    if (hit && solid) solid.material.emissive.copy(colour("--failed")).multiplyScalar(0.8);
    const ends = [nearest.on_tool_mm, nearest.on_solid_mm].map((at) => new THREE.Vector3(...at));
    this.pair.add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(ends), material(THREE.LineBasicMaterial, "--failed")));
    for (const at of ends) {
      const ball = new THREE.Mesh(new THREE.SphereGeometry(1.6, 16, 12), material(THREE.MeshBasicMaterial, "--failed"));
      ball.position.copy(at);
      this.pair.add(ball);
    }
    this.draw();
  }
  // left: of a check; none: the workpieces as they were.
  showLeft(left, solids) {
    for (const solid of solids.filter((one) => one.part === "workpiece")) {
      const mesh = this.solids.get(solid.name), found = left.find((one) => one.solid === solid.name);
      if (!found && !mesh.userData.cut) continue;
      mesh.userData.cut = Boolean(found);
      mesh.geometry.dispose();
      mesh.geometry = found ? remaining(solid, found) : geometryOf(solid);
      const [edges] = mesh.children;
      edges.geometry.dispose();
      edges.geometry = new THREE.EdgesGeometry(mesh.geometry, 30);
      mesh.material.opacity = found ? 1 : 0.8;
      mesh.material.transparent = !found;
      mesh.material.needsUpdate = true;
    }
    this.draw();
  }
  showPath(report, zero) {
    this.empty(this.path);
    if (report.from === null) return;
    let before = new THREE.Vector3(...report.from);
    const points = { true: [], false: [] };
    for (const move of report.path) {
      const to = new THREE.Vector3(...move.to);
      points[move.rapid].push(before, to);
      before = to;
    }
    for (const [rapid, name] of [["true", "--series2"], ["false", "--series1"]])
      this.path.add(new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(points[rapid]), material(THREE.LineBasicMaterial, name)));
    this.path.position.set(...zero);
    this.draw();
  }
  recolour() {
    this.scene.background = colour("--plot");
    this.scene.traverse((one) => { if (one.material?.userData.colour) one.material.color.copy(colour(one.material.userData.colour)); });
    this.draw();
  }
  draw() {
    this.renderer.render(this.scene, this.camera);
  }
  dispose() {
    this.scheme.removeEventListener("change", this.redraw);
    this.observer.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }
}
