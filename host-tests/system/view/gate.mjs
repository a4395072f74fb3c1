// Who is let in: foreign origins, wrong tokens, other names of this computer.
import { request } from "node:http";
import { connect } from "node:net";
import { box, check, run, view, write } from "./common.mjs";

const ask = (address, path, { method = "GET", headers = {}, body } = {}) => new Promise((done, fail) => {
  const url = new URL(address);
  const asked = request({ host: "127.0.0.1", port: url.port, path, method, headers: { Host: url.host, ...headers } }, (response) => {
    let text = "";
    response.on("data", (data) => { text += data; if (path === "/api/events") asked.destroy(); });
    response.on("close", () => done({ status: response.statusCode, headers: response.headers, text }));
  });
  asked.on("error", (error) => (path === "/api/events" ? done({ status: 200, headers: {}, text: "" }) : fail(error)));
  asked.end(body);
});

// A head without an end is answered before it fills the memory: returns how the answer begins, and the bytes that were sent.
const endless = (address) => new Promise((done) => {
  let text = "", sent = 0;
  const line = `X-Filler: ${"x".repeat(1000)}\r\n`;
  const socket = connect(new URL(address).port, "127.0.0.1");
  // Between two lines it reads: writes that are taken at once would not let it.
  const send = (error) => setImmediate(() => { if (!error && !text && sent < 100e6) { sent += line.length; socket.write(line, send); } });
  socket.on("connect", () => socket.write("GET / HTTP/1.1\r\n", send));
  socket.on("data", (data) => { text += data; socket.end(); });
  socket.on("error", () => {});
  socket.on("close", () => done({ answer: text.slice(0, 12), sent }));
});

const CELL = `
[cell]
name = "lengths"
[[rotary_axis]]
letter = "C"
carries = "solids"
through_mm = [0, 0, 0]
[[solid]]
name = "plate"
part = "fixture"
shape = "box"
size_mm = [10, 200, 10]
at_mm = [20, 0, 5]
moves_with = "C"
[[tool]]
number = 4
holder_radius_mm = 20
holder_length_mm = 62
radius_mm = 6
length_mm = 58
cutting_mm = 30
`;

// A request in the name of the page itself.
async function asPage(server) {
  const url = new URL(server.address);
  const entered = await ask(server.address, `/?token=${url.searchParams.get("token")}`);
  const Cookie = entered.headers["set-cookie"][0].split(";")[0];
  return async (path, body) => {
    const answer = await ask(server.address, path, body === undefined ? { headers: { Cookie } } : { method: "POST", headers: { Cookie, Origin: `http://${url.host}` }, body: JSON.stringify(body) });
    return { status: answer.status, told: JSON.parse(answer.text) };
  };
}

// What is no number is refused by its key, and a step is marked only while it is the one that the page shows.
async function refusesWhatItCannotRead(server) {
  const page = await asPage(server);
  const wrong = [["/api/start", { method: "delay-multi-speed", overtravel_mm: null }, /overtravel_mm/], ["/api/start", { method: "delay-multi-speed", speeds_mm_s: [5, null] }, /speeds_mm_s/],
    ["/api/start", { method: "delay-multi-speed", angles: 70000 }, /angles/], ["/api/start", { method: "delay-multi-speed", angles: 2.5 }, /angles/], ["/api/start", { method: "delay-multi-speed", axis: "Q" }, /axis/],
    ["/api/mark", { phase: "Begin", run: 0, step: 0 }, /phase/], ["/api/mark", { phase: "abandon", run: 99, step: 0 }, /look at the step/], ["/api/accept", { id: 1, by: "Ada", although_it_differs: "yes" }, /although_it_differs/]];
  for (const [path, body, words] of wrong) {
    const { status, told } = await page(path, body);
    check(status >= 400 && status < 500 && words.test(told.what), `${path} ${JSON.stringify(body)}: ${status} ${told.what}`);
  }
}

// The holder of a tool that is 8 mm shorter than cell.toml says is 8 mm nearer.
async function checksWithMeasuredLengths(server) {
  const page = await asPage(server);
  const near = async (more) => (await page(`/api/nearest?tool=4&x=0&y=0&z=-42${more}`)).told;
  const stored = await near(""), measured = await near("&length=50&w1x=0&w1y=0");
  check(Math.abs(stored.distance_mm - 6) < 1e-3 && stored.tool_part === "holder", JSON.stringify(stored));
  check(measured.distance_mm === 0 && measured.tool_part === "holder", JSON.stringify(measured));
  const below = async (holder) => (await page(`/api/nearest?tool=4&x=0&y=0&z=-80&length=58&w1x=0&w1y=0&holder=${holder}`)).told.distance_mm;
  check((await below(62)) === 0 && Math.abs((await below(20)) - 2) < 1e-3, "a holder of 20 mm ends below the plate");
  check((await page("/api/nearest?tool=4&x=0&y=0&z=0&length=58&w1x=0&w1y=0&holder=-1")).status === 400, "a holder of less than nothing");
  const program = "G0 X0 Y0 Z20\nZ-42\n";
  const hits = async (more) => (await page("/api/check", { tool: 4, program, ...more })).told.hits.length;
  const short = { measured: { assembled_mm: 50, W1_mm: [0, 0] } };
  check((await hits({})) === 0 && (await hits(short)) === 1 && (await hits({ ...short, stored: true })) === 0, "the measured lengths count in a check");
  for (const bad of ["&length=nan&w1x=0&w1y=0", "&length=12&w1x=0&w1y=0", "&length=50&w1x=99&w1y=0"]) check((await page(`/api/nearest?tool=4&x=0&y=0&z=0${bad}`)).status === 400, bad);
  const beside = async (c) => (await page(`/api/nearest?tool=4&x=0&y=-30&z=-42&c=${c}`)).told.distance_mm;
  check(Math.abs((await beside(0)) - 6) < 1e-3 && Math.abs((await beside(90)) - Math.hypot(25, 6)) < 1e-3, "C turns the plate away");
  check((await page("/api/nearest?tool=4&x=0&y=0&z=0&b=nan")).status === 400, "an angle that is no number");
  check((await page("/api/nearest?tool=4&x=nan&y=0&z=0")).status === 400, "a place that is no number");
}

run(async () => {
  const daemon = await box();
  const server = await view(daemon.uri);
  const url = new URL(server.address);
  check(url.hostname === "127.0.0.1", "served on localhost");
  const token = url.searchParams.get("token");
  check(token.length === 64 && (await view(daemon.uri)).address.indexOf(token) < 0, "a token is used twice");
  const entered = await ask(server.address, `/?token=${token}`);
  check(entered.status === 303 && entered.headers.location === "/", `${entered.status}`);
  const [cookie] = entered.headers["set-cookie"];
  check(/HttpOnly/.test(cookie) && /SameSite=Strict/.test(cookie), cookie);
  const Cookie = cookie.split(";")[0];

  const page = await ask(server.address, "/", { headers: { Cookie } });
  check(page.status === 200 && /<title>probebox/.test(page.text), `${page.status}`);
  const policy = page.headers["content-security-policy"];
  check(/default-src 'none'/.test(policy) && /frame-ancestors 'none'/.test(policy), policy);
  check((await ask(server.address, "/api/about", { headers: { Cookie } })).status === 200, "the page itself");

  const origin = `http://${url.host}`;
  const body = JSON.stringify({ run: 0 });
  const refused = {
    "no cookie": ["/api/about", {}],
    "no cookie, the page": ["/", {}],
    "wrong token": [`/?token=${"0".repeat(64)}`, {}],
    "a part of the token": [`/?token=${token.slice(0, 63)}`, {}],
    "wrong cookie": ["/api/about", { headers: { Cookie: Cookie.slice(0, -1) } }],
    "another port's cookie": ["/api/about", { headers: { Cookie: Cookie.replace(/^probebox\d+/, "probebox1") } }],
    "a name that leads here": ["/api/about", { headers: { Cookie, Host: `evil.example:${url.port}` } }],
    "a name without the port": ["/api/about", { headers: { Cookie, Host: "127.0.0.1" } }],
    "a foreign origin": ["/api/about", { headers: { Cookie, Origin: "http://evil.example" } }],
    "a foreign origin of this computer": ["/api/about", { headers: { Cookie, Origin: "http://127.0.0.1:1" } }],
    "an origin that is hidden": ["/api/about", { headers: { Cookie, Origin: "null" } }],
    "a page of another site": ["/api/about", { headers: { Cookie, "Sec-Fetch-Site": "cross-site" } }],
    "a change without an origin": ["/api/abort", { method: "POST", headers: { Cookie }, body }],
    "a change by another page": ["/api/abort", { method: "POST", headers: { Cookie, Origin: "https://evil.example" }, body }],
    "a change without a cookie": ["/api/abort", { method: "POST", headers: { Origin: origin }, body }],
  };
  for (const [who, [path, options]] of Object.entries(refused)) {
    const answer = await ask(server.address, path, options);
    check(answer.status === 403 && !answer.headers["set-cookie"] && !/SIM-0001/.test(answer.text), `${who}: ${answer.status}`);
  }
  const changed = await ask(server.address, "/api/abort", { method: "POST", headers: { Cookie, Origin: origin }, body });
  check(changed.status === 200 || changed.status === 409, `the page itself: ${changed.status} ${changed.text}`);
  for (const broken of ["", "{", "[]", '{"run":"x"}', '{"run":1e300}', '{"id":-1,"by":7}']) {
    for (const path of ["/api/accept", "/api/start", "/api/rollback", "/api/mark", "/api/check"]) {
      const answer = await ask(server.address, path, { method: "POST", headers: { Cookie, Origin: origin }, body: broken });
      check(answer.status >= 400 && answer.status < 500 && JSON.parse(answer.text).what.length > 5, `${path} ${broken}: ${answer.status} ${answer.text}`);
    }
  }
  const { answer, sent } = await endless(server.address);
  check(answer === "HTTP/1.1 431" && sent < 10e6, `an endless head: ${answer} behind ${sent} bytes`);
  check((await ask(server.address, "/api/about", { headers: { Cookie } })).status === 200, "it still serves");
  await refusesWhatItCannotRead(server);
  const celled = await view(daemon.uri, "--cell", write("lengths.toml", CELL));
  if (!/built without FCL/.test((await (await asPage(celled))("/api/nearest?tool=4&x=0&y=0&z=0")).told.what ?? "")) await checksWithMeasuredLengths(celled);
  console.log(`${Object.keys(refused).length} strangers refused`);
});
