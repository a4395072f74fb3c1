#include "tools/probebox/view/server.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <httplib.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <thread>

#include "tools/probebox/view/answers.hpp"
#include "tools/probebox/view/assets.hpp"
#include "tools/probebox/view/bounded_server.hpp"
#include "tools/probebox/view/gate.hpp"

namespace probebox::view {
namespace {

// Connections served at once: each page holds one for its events. One that sends nothing is not accepted for kSilent,
// and holds its thread for no longer.
constexpr std::size_t kThreads = 64;
constexpr std::chrono::seconds kSilent{2};
constexpr std::size_t kMostBody = 8'000'000;  // a program with many lines
constexpr const char* kJson = "application/json";

// Nothing is fetched from anywhere else, nothing may put the page into a frame, and what a report holds runs no script.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; connect-src "
    "'self'; "
    "frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
constexpr const char* kReportPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; sandbox; frame-ancestors 'self'";

int statusOf(const Trouble& trouble) {
  if (trouble.status == command::ExitStatus::no_box) return 503;
  return trouble.status == command::ExitStatus::usage ? 400 : 409;
}

void give(httplib::Response& response, const BoxConnection::Answer& answer, const char* type = kJson) {
  if (answer) return response.set_content(*answer, type);
  response.status = statusOf(answer.error());
  response.set_content(Json{{"error", answer.error().name}, {"what", answer.error().what}}.dump(), kJson);
}

std::uint64_t numberIn(const httplib::Request& request, const char* name) {
  return std::strtoull(request.get_param_value(name).c_str(), nullptr, 10);
}

}  // namespace

struct Server::Http {
  Http(BoxConnection& of_box, const CellRequestHandler& of_cell, EventLog& log)
      : connection{of_box}, cell{of_cell}, events{log} {}

  // True where the request has been answered: it may not come in.
  bool turnAway(const httplib::Request& request, httplib::Response& response) const {
    const Asked asked{request.method,
                      request.path,
                      request.get_param_value("token"),
                      request.get_header_value("Cookie"),
                      request.get_header_value("Host"),
                      request.get_header_value("Origin"),
                      request.get_header_value("Sec-Fetch-Site")};
    switch (gate->judge(asked)) {
      case Verdict::let_in:
        return false;
      case Verdict::give_cookie:
        response.set_header("Set-Cookie", gate->cookie());
        response.set_redirect("/", 303);
        return true;
      case Verdict::wrong_host:
      case Verdict::wrong_origin:
      case Verdict::without_token:
        response.status = 403;
        response.set_header("Connection", "close");
        response.set_content("Not for you: open the address that `probebox view` has printed.\n", "text/plain");
        return true;
    }
    return true;
  }

  void declare() {
    server.new_task_queue = [] { return new httplib::ThreadPool{kThreads}; };
    server.set_read_timeout(kSilent);
    server.set_keep_alive_timeout(kSilent.count());
    server.set_payload_max_length(kMostBody);
    server.set_default_headers(
        {{"X-Content-Type-Options", "nosniff"}, {"Referrer-Policy", "no-referrer"}, {"Cache-Control", "no-store"}});
    server.set_pre_routing_handler([this](const auto& request, auto& response) {
      return turnAway(request, response) ? httplib::Server::HandlerResponse::Handled
                                         : httplib::Server::HandlerResponse::Unhandled;
    });
    declareFiles();
    declareReading();
    declareChanging();
    declareCell();
    server.Get("/api/events", [this](const auto& request, auto& response) { follow(request, response); });
  }

  void declareFiles() {
    for (const auto& asset : assets()) {
      server.Get(asset.path, [asset](const auto&, auto& response) {
        response.set_header("Content-Security-Policy", kPolicy);
        response.set_content(asset.content.data(), asset.content.size(), asset.type);
      });
    }
  }

  void declareReading() {
    server.Get("/api/about", [this](const auto&, auto& response) { response.set_content(connection.about(), kJson); });
    server.Get("/api/link",
               [this](const auto&, auto& response) { response.set_content(connection.linkState(), kJson); });
    server.Get("/api/machine",
               [this](const auto&, auto& response) { response.set_content(connection.machine(), kJson); });
    server.Get("/api/methods", [](const auto&, auto& response) { response.set_content(methods(), kJson); });
    server.Get("/api/plan", [this](const auto& request, auto& response) {
      give(response, forecast(request.get_param_value("method"), machineOf(connection)));
    });
    server.Get("/api/window", [this](const auto& request, auto& response) {
      const auto columns = std::min<std::uint64_t>(numberIn(request, "columns"), 4000);
      give(response,
           connection.window(static_cast<std::int64_t>(numberIn(request, "from_ns")),
                             static_cast<std::int64_t>(numberIn(request, "to_ns")), static_cast<std::size_t>(columns)));
    });
    server.Get("/api/stores", [this](const auto&, auto& response) { give(response, connection.ask(&stores)); });
    server.Get("/api/results", [this](const auto&, auto& response) { give(response, connection.ask(&results)); });
    const auto about_one = [this](const char* path, auto function, const char* type) {
      server.Get(path, [this, function, type](const auto& request, auto& response) {
        const auto id = numberIn(request, "id");
        if (type != kJson) response.set_header("Content-Security-Policy", kReportPolicy);
        give(response, connection.ask([&](link::Client& box, Console& console) { return function(box, console, id); }),
             type);
      });
    };
    about_one("/api/result", &result, kJson);
    about_one("/api/comparison", &comparison, kJson);
    about_one("/api/report", &reportPage, "text/html; charset=utf-8");
    server.Get("/api/history", [this](const auto& request, auto& response) {
      const auto subject = request.get_param_value("subject");
      give(response,
           connection.ask([&](link::Client& box, Console& console) { return history(box, console, subject); }));
    });
  }

  // The cell is on this computer: the box is not asked.
  void declareCell() {
    server.Get("/api/cell", [this](const auto&, auto& response) { response.set_content(cell.scene(), kJson); });
    server.Get("/api/nearest", [this](const auto& request, auto& response) {
      const auto value = [&](const char* name) { return std::strtod(request.get_param_value(name).c_str(), nullptr); };
      std::optional<Measured> measured;
      if (request.has_param("length")) measured = Measured{value("length"), {value("w1x"), value("w1y")}};
      if (measured && request.has_param("holder")) measured->holder_mm = value("holder");
      const interference::Pose pose{{value("x"), value("y"), value("z")}, {value("a"), value("b"), value("c")}};
      give(response, cell.nearest(static_cast<std::uint32_t>(numberIn(request, "tool")), measured, pose));
    });
    server.Post("/api/check",
                [this](const auto& request, auto& response) { give(response, cell.check(request.body)); });
  }

  void declareChanging() {
    const auto post = [this](const char* path, auto function) {
      server.Post(path, [this, function](const auto& request, auto& response) {
        give(response,
             connection.ask([&](link::Client& box, Console& console) { return function(box, console, request.body); }));
      });
    };
    post("/api/start", &start);
    post("/api/abort", &abortRun);
    post("/api/mark", &mark);
    post("/api/accept", &accept);
    post("/api/rollback", &rollback);
  }

  void follow(const httplib::Request& request, httplib::Response& response) {
    // A page that begins is told the last seconds too; one that was cut off goes on where it was.
    const auto had = request.get_header_value("Last-Event-ID");
    auto next = std::make_shared<std::uint64_t>(had.empty() ? 0 : std::strtoull(had.c_str(), nullptr, 10) + 1);
    response.set_header("X-Accel-Buffering", "no");
    response.set_chunked_content_provider("text/event-stream", [this, next](std::size_t, httplib::DataSink& sink) {
      auto news = events.since(*next);
      if (events.ended()) {
        sink.done();
        return true;
      }
      if (news.empty()) news = ": nothing new\n\n";
      return sink.write(news.data(), news.size());
    });
  }

  BoxConnection& connection;
  const CellRequestHandler& cell;
  EventLog& events;
  BoundedServer server;
  std::optional<Gate> gate;
  std::thread thread;
};

Server::Server(BoxConnection& connection, const CellRequestHandler& cell, EventLog& events)
    : http_{std::make_unique<Http>(connection, cell, events)} {}

Server::~Server() {
  http_->events.end();
  // A server that has not begun yet would not hear of it.
  for (int k = 0; k < 1000 && http_->thread.joinable() && !http_->server.is_running(); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  http_->server.stop();
  if (http_->thread.joinable()) http_->thread.join();
}

std::optional<std::string> Server::listen(unsigned port) {
  auto& server = http_->server;
  server.set_socket_options([](socket_t listener) {
    const int on = 1, silent_s = static_cast<int>(kSilent.count());
    ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    ::setsockopt(listener, IPPROTO_TCP, TCP_DEFER_ACCEPT, &silent_s, sizeof silent_s);
  });
  const bool any = port == 0;
  const int bound = any ? server.bind_to_any_port("127.0.0.1") : static_cast<int>(port);
  if (bound <= 0 || (!any && !server.bind_to_port("127.0.0.1", bound))) return std::nullopt;
  http_->gate.emplace(static_cast<unsigned>(bound), randomToken());
  http_->declare();
  http_->thread = std::thread{[&server] { server.listen_after_bind(); }};
  return "http://127.0.0.1:" + std::to_string(bound) + "/?token=" + http_->gate->token();
}

}  // namespace probebox::view
