// The cell in three dimensions: solids, a tool in its holder, a path, and the pair that is nearest. Z is up.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const colour = (name) => new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue(name).trim());
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
    this.solids = new Map();
    for (const solid of cell.solids) {
      const material = new THREE.MeshStandardMaterial({ color: colour(COLOURS[solid.part]), roughness: 0.75, transparent: solid.part === "workpiece", opacity: solid.part === "workpiece" ? 0.8 : 1, side: THREE.DoubleSide });
      const mesh = new THREE.Mesh(geometryOf(solid), material);
      mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(mesh.geometry, 30), new THREE.LineBasicMaterial({ color: colour("--ink"), transparent: true, opacity: 0.45 })));
      mesh.position.set(...solid.at_mm);
      mesh.rotation.set(...solid.turn_deg.map(THREE.MathUtils.degToRad), "ZYX");
      this.solids.set(solid.name, mesh);
      this.scene.add(mesh);
    }
    this.tool = new THREE.Group();
    this.pair = new THREE.Group();
    this.path = new THREE.Group();
    this.scene.add(this.tool, this.pair, this.path);
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(holder);
    this.redraw = () => this.draw();
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.scheme.addEventListener("change", this.redraw);
    this.fit();
    this.home();
  }
  fit() {
    const { clientWidth: width, clientHeight: height } = this.holder;
    if (width === 0) return;
    this.renderer.setPixelRatio(devicePixelRatio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }
  home() {
    const all = new THREE.Box3();
    for (const mesh of this.solids.values()) all.expandByObject(mesh);
    all.expandByObject(this.tool);
    if (all.isEmpty()) all.set(new THREE.Vector3(-100, -100, -100), new THREE.Vector3(100, 100, 100));
    const middle = all.getCenter(new THREE.Vector3()), size = Math.max(50, all.getSize(new THREE.Vector3()).length());
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).add(new THREE.Vector3(0.55, -1, 0.6).normalize().multiplyScalar(size * 1.45));
    this.controls.update();
    this.draw();
  }
  // A geometry stays in the graphics memory until it is disposed of.
  empty(group) {
    for (const one of group.children) { one.geometry.dispose(); one.material.dispose(); }
    group.clear();
  }
  setTool(tool) {
    this.empty(this.tool);
    const part = (geometry, name) => this.tool.add(new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color: colour(name), roughness: 0.5, metalness: 0.2 })));
    const long = tool.assembled_length_mm;
    part(upright(tool.radius_mm, 0, tool.cutting_mm), "--series2");
    part(upright(tool.radius_mm, tool.cutting_mm, long), "--series4");
    part(upright(tool.holder_radius_mm, long, long + tool.holder_length_mm), "--neutral");
    this.tip = tool.tip_from_axis_mm;
    this.draw();
  }
  moveTool([x, y, z]) {
    this.tool.position.set(x + this.tip[0], y + this.tip[1], z);
    this.draw();
  }
  showPair(nearest, hit) {
    this.empty(this.pair);
    for (const mesh of this.solids.values()) mesh.material.emissive?.set(0);
    const solid = this.solids.get(nearest.solid);
    if (hit && solid) solid.material.emissive.copy(colour("--failed")).multiplyScalar(0.8);
    const ends = [nearest.on_tool_mm, nearest.on_solid_mm].map((at) => new THREE.Vector3(...at));
    this.pair.add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(ends), new THREE.LineBasicMaterial({ color: colour("--failed") })));
    for (const at of ends) {
      const ball = new THREE.Mesh(new THREE.SphereGeometry(1.6, 16, 12), new THREE.MeshBasicMaterial({ color: colour("--failed") }));
      ball.position.copy(at);
      this.pair.add(ball);
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
      this.path.add(new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(points[rapid]), new THREE.LineBasicMaterial({ color: colour(name) })));
    this.path.position.set(...zero);
    this.draw();
  }
  draw() {
    this.scene.background = colour("--plot"); // it may have become dark meanwhile
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
