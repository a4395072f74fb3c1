// Who is let in: foreign origins, wrong tokens, other names of this computer.
import { request } from "node:http";
import { box, check, run, view } from "./common.mjs";

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
  check((await ask(server.address, "/api/about", { headers: { Cookie } })).status === 200, "it still serves");
  console.log(`${Object.keys(refused).length} strangers refused`);
});
